"""Field signatures: which place of a surface a point is, to find it again and to register scans."""

from .keypoints import keypoints
from .matching import FieldMatches, match_fields
from .signatures import FieldSignatures, field_signatures

__all__ = ["FieldMatches", "FieldSignatures", "field_signatures", "keypoints", "match_fields"]
