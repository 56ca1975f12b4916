"""Field signatures: which place of a surface a point is, to find it again and to register scans."""

from .keypoint_selection import find_keypoints
from .matching import FieldMatches, match_fields
from .signatures import FieldSignatures, extract_field_signatures

__all__ = ["FieldMatches", "FieldSignatures", "extract_field_signatures", "find_keypoints", "match_fields"]
