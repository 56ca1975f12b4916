/**
 * @file
 * surfsig in C: curvature and surface signatures of point clouds.
 *
 * Every function that can fail returns a surfsig_code; where it is not SURFSIG_CODE_OK, surfsig_last_error()
 * says in one line what is wrong. Lengths are in the cloud's own unit, curvatures per that unit; NaN where
 * there is no value. Functions may be called from several threads at once; one options object must not be
 * changed by one thread while another uses it. Null is allowed where a comment says so, and is an error,
 * never a crash, elsewhere.
 *
 * Generated from the Rust sources by cbindgen: `make header` makes it anew.
 */

#ifndef SURFSIG_H
#define SURFSIG_H

#include <stddef.h>
#include <stdint.h>

/**
 * Numbers of a signature.
 */
#define SURFSIG_SIGNATURE 242

/**
 * What became of a call.
 */
typedef enum {
  /**
   * It did what was asked for.
   */
  SURFSIG_CODE_OK = 0,
  /**
   * An argument has no meaning: a mistake that the caller can mend.
   */
  SURFSIG_CODE_INVALID_INPUT = 1,
  /**
   * The operating system refused the threads.
   */
  SURFSIG_CODE_SYSTEM = 2,
  /**
   * A bug in surfsig: please report it with the text of surfsig_last_error().
   */
  SURFSIG_CODE_INTERNAL = 3,
} surfsig_code;

/**
 * What became of a point. Everything but SURFSIG_STATUS_OK says why values are missing or weak.
 */
enum surfsig_status
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * All values are there.
   */
  SURFSIG_STATUS_OK = 0,
  /**
   * A coordinate of the point is not finite: no values.
   */
  SURFSIG_STATUS_NOT_FINITE = 1,
  /**
   * Fewer than six points in the ball: no curvature; a normal where three points span a plane.
   */
  SURFSIG_STATUS_TOO_FEW_POINTS = 2,
  /**
   * The points lie on a line, or on a conic, and determine no paraboloid: no curvature.
   */
  SURFSIG_STATUS_DEGENERATE = 3,
  /**
   * The axes did not settle: the values are those of the last turn. Typical of edges, corners and
   * patches that are large against the radius of curvature.
   */
  SURFSIG_STATUS_NOT_CONVERGED = 4,
  /**
   * The surface is more curved than any atom of the frame: curvature, but no signature.
   */
  SURFSIG_STATUS_OUTSIDE_VOCABULARY = 5,
  /**
   * The points lie mostly on one side, as at the rim of a scan: all values are there, with the standard
   * errors of such a patch, and a bias where the surface is not a paraboloid.
   */
  SURFSIG_STATUS_ONE_SIDED = 6,
  /**
   * Coordinates come in steps too large for the radius: no curvature, and a normal of the points as they are.
   */
  SURFSIG_STATUS_TOO_COARSE = 7,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum surfsig_status surfsig_status;
#else
typedef uint8_t surfsig_status;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * In which axes the paraboloid's height is measured.
 */
typedef enum {
  /**
   * The surface's own: results turn with the object, and do not depend on where the sensor stood.
   */
  SURFSIG_AXES_SURFACE = 0,
  /**
   * The cloud's, as the paper fits: z runs away from the sensor.
   */
  SURFSIG_AXES_SENSOR = 1,
} surfsig_axes;

/**
 * What an extraction gives: columns of one length, in the order of the places. Made by
 * surfsig_extract_f32() or surfsig_extract_f64(), freed by surfsig_extraction_free(). It refers to
 * nothing of the caller's.
 */
typedef struct surfsig_extraction surfsig_extraction;

/**
 * How an extraction is done. Made by surfsig_options_new(), freed by surfsig_options_free().
 */
typedef struct surfsig_options surfsig_options;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * The library's version, "major.minor.patch"; null-terminated, never to be freed.
 */
const char *surfsig_version(void);

/**
 * One line about the last call of this thread that failed; empty where none has. Never to be freed; valid
 * until the thread's next call that fails.
 */
const char *surfsig_last_error(void);

/**
 * Extracts curvature from the points within a radius; eq. (5) of the paper, and from it k1 and k2.
 *
 * Points that are not finite belong to no ball and get SURFSIG_STATUS_NOT_FINITE. No point at all gives an
 * extraction of size 0.
 *
 * @param points x of the first point; its y and z follow it. May have any alignment; null only if count is 0.
 * @param count Number of points.
 * @param stride Bytes from one point's x to the next one's, at least 12: 12 for packed coordinates, which
 * are used where they are; sizeof(pcl::PointXYZ) and the like otherwise, and the coordinates are copied.
 * @param origin x, y, z that are added to each point, finite; null for 0, 0, 0.
 * @param radius Radius of the ball around each place, in the cloud's unit; finite and above 0.
 * @param options How; null for the default.
 * @param extraction Where the result is put; null is put there where the call fails.
 */
surfsig_code surfsig_extract_f32(const float *points,
                                 size_t count,
                                 size_t stride,
                                 const double *origin,
                                 double radius,
                                 const surfsig_options *options,
                                 surfsig_extraction **extraction);

/**
 * Extracts curvature from points in double precision, as surfsig_extract_f32() does; the stride is at
 * least 24 bytes.
 *
 * @param points x of the first point; its y and z follow it. May have any alignment; null only if count is 0.
 * @param count Number of points.
 * @param stride Bytes from one point's x to the next one's.
 * @param origin x, y, z that are added to each point, finite; null for 0, 0, 0.
 * @param radius Radius of the ball around each place, in the cloud's unit; finite and above 0.
 * @param options How; null for the default.
 * @param extraction Where the result is put; null is put there where the call fails.
 */
surfsig_code surfsig_extract_f64(const double *points,
                                 size_t count,
                                 size_t stride,
                                 const double *origin,
                                 double radius,
                                 const surfsig_options *options,
                                 surfsig_extraction **extraction);

/**
 * Frees an extraction and its columns; does nothing with null.
 */
void surfsig_extraction_free(surfsig_extraction *extraction);

/**
 * Number of places, which is the length of each column; 0 for null.
 */
size_t surfsig_extraction_size(const surfsig_extraction *extraction);

/**
 * Larger principal curvature by value, (size) floats per unit of length; a bump seen from the sensor is
 * positive. Like every column it lives as long as the extraction; null where that is empty or null.
 */
const float *surfsig_extraction_k1(const surfsig_extraction *extraction);

/**
 * Smaller principal curvature by value, (size) floats per unit of length.
 */
const float *surfsig_extraction_k2(const surfsig_extraction *extraction);

/**
 * Unit normals of the fitted surface, towards the sensor: (size, 3) floats, row by row.
 */
const float *surfsig_extraction_normals(const surfsig_extraction *extraction);

/**
 * Unit tangents along k1, (size, 3) floats, row by row; the sign means nothing.
 */
const float *surfsig_extraction_directions(const surfsig_extraction *extraction);

/**
 * Root mean square of the points' heights above the fit, (size) floats.
 */
const float *surfsig_extraction_residual(const surfsig_extraction *extraction);

/**
 * How much, at least, the worst determined coefficient suffers from the points' arrangement, (size)
 * floats: the factor on its standard error, 1 for not at all, about 1.5 on a full disc.
 */
const float *surfsig_extraction_condition(const surfsig_extraction *extraction);

/**
 * Standard error of (k1 + k2) / 2, (size) floats; NaN in the sensor's axes and where no more than six
 * points are in the ball.
 */
const float *surfsig_extraction_mean_curvature_std(const surfsig_extraction *extraction);

/**
 * Standard error of k1, (size) floats; right where k1 and k2 differ significantly.
 */
const float *surfsig_extraction_k1_std(const surfsig_extraction *extraction);

/**
 * Standard error of k2, (size) floats.
 */
const float *surfsig_extraction_k2_std(const surfsig_extraction *extraction);

/**
 * Points in the ball, the place itself included, (size) numbers.
 */
const uint32_t *surfsig_extraction_count(const surfsig_extraction *extraction);

/**
 * What became of each place, (size) bytes.
 */
const surfsig_status *surfsig_extraction_status(const surfsig_extraction *extraction);

/**
 * (l1 - l2) / l1 of the covariance's eigenvalues, (size) floats: 1 on a line.
 */
const float *surfsig_extraction_linearity(const surfsig_extraction *extraction);

/**
 * (l2 - l3) / l1, (size) floats: 1 on a plane.
 */
const float *surfsig_extraction_planarity(const surfsig_extraction *extraction);

/**
 * l3 / l1, (size) floats: 1 in a volume.
 */
const float *surfsig_extraction_scattering(const surfsig_extraction *extraction);

/**
 * Makes options of the default values: the surface's axes, no viewpoint, all cores, every point.
 */
surfsig_options *surfsig_options_new(void);

/**
 * Frees options; does nothing with null.
 */
void surfsig_options_free(surfsig_options *options);

/**
 * Chooses the axes in which the paraboloids are fitted.
 *
 * @param options The options to change.
 * @param axes A surfsig_axes; any other number is SURFSIG_CODE_INVALID_INPUT.
 */
surfsig_code surfsig_options_set_axes(surfsig_options *options, int axes);

/**
 * Says where the sensor stood; normals then point to it, and a bump seen from there has a positive
 * curvature. Without a viewpoint the side of each normal is a convention: its z is positive (in the
 * sensor's axes negative).
 *
 * @param options The options to change.
 * @param viewpoint x, y, z in the cloud's coordinates, finite; null for none.
 */
surfsig_code surfsig_options_set_viewpoint(surfsig_options *options, const double *viewpoint);

/**
 * Chooses the number of threads. The result is the same, bit for bit.
 *
 * @param options The options to change.
 * @param threads 1 to 1024; 0 for all cores.
 */
surfsig_code surfsig_options_set_threads(surfsig_options *options, uint32_t threads);

/**
 * Counts only the nearest of the points within the radius.
 *
 * @param options The options to change.
 * @param neighbors At most this many, the place itself included; 0 for all of them.
 */
surfsig_code surfsig_options_set_neighbors(surfsig_options *options, uint32_t neighbors);

/**
 * Leaves out points farther from the fitted surface than three standard deviations of the others, and
 * fits again, until the choice stands; the count is then that of the points that stay.
 *
 * @param options The options to change.
 * @param robust 1 to do so, 0 (the default) not to.
 */
surfsig_code surfsig_options_set_robust(surfsig_options *options, int robust);

/**
 * Chooses the points at which curvature is asked for; the others are neighbours only. An index that the
 * cloud does not have is an error of the extraction.
 *
 * @param options The options to change.
 * @param indices Numbers of points, from 0; they are copied. Null only if count is 0.
 * @param count How many they are; 0 asks for no place at all.
 */
surfsig_code surfsig_options_set_indices(surfsig_options *options, const uint32_t *indices, size_t count);

/**
 * Makes the signatures of chosen places, in the default frame. The first call of a process also makes the
 * frame, in some tens of milliseconds.
 *
 * @param extraction Where the places' surfaces are.
 * @param places Numbers of places, from 0, (count); null for the first count of them.
 * @param count How many; 0 does nothing.
 * @param signatures Where they are put: (count, 242) floats, row by row; NaN where there is none.
 * @param statuses Where it is put why, (count); null if nobody asks.
 */
surfsig_code surfsig_signatures(const surfsig_extraction *extraction,
                                const uint32_t *places,
                                size_t count,
                                float *signatures,
                                surfsig_status *statuses);

/**
 * zeta of eq. (12): how alike the surfaces of two signatures are, from 0 to 1; 0.9 and above is optimal, 0.5
 * and above good. NaN where a signature is missing, zero, or null.
 *
 * Both must have been made at the same radius, in the same axes. Where an extraction knew no viewpoint, it
 * may have seen the surface from its other side, from where the signature is another one.
 *
 * @param a 242 floats.
 * @param b 242 floats.
 */
double surfsig_similarity(const float *a, const float *b);

/**
 * The name of a surfsig_status, such as "too_few_points"; null for a number that is none. Never to be freed.
 */
const char *surfsig_status_name(uint8_t status);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* SURFSIG_H */
