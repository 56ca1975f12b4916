/**
 * @file
 * surfsig in C: curvature, surface signatures and surfaces of point clouds.
 *
 * Every function that can fail returns a surfsig_code; where it is not SURFSIG_CODE_OK, surfsig_last_error()
 * says in one line what is wrong. Lengths are in the cloud's own unit, curvatures per that unit; NaN where
 * there is no value. Functions may be called from several threads at once; one options object must not be
 * changed by one thread while another uses it. Null is allowed where a comment says so, and is an error,
 * never a crash, elsewhere; so are a count that no memory holds, a stride that is too small, a number that no
 * enum has, and coordinates that are not finite.
 *
 * A query is a point at which something is asked for: a point of the cloud, or a position of its own.
 *
 * Generated from the Rust sources by cbindgen: `make header` makes it anew.
 */

#ifndef SURFSIG_H
#define SURFSIG_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/**
 * Numbers of a set of moments.
 */
#define SURFSIG_MOMENTS 35

/**
 * Most directions in which a transform can be free.
 */
#define SURFSIG_FREE_DIRECTIONS 6

/**
 * Most alternatives that are given.
 */
#define SURFSIG_ALTERNATIVES 8

/**
 * A doubt: nothing was found.
 */
#define SURFSIG_DOUBT_NOT_FOUND 1

/**
 * A doubt: few matches agree.
 */
#define SURFSIG_DOUBT_FEW_MATCHES 2

/**
 * A doubt: little of the source lies on the target.
 */
#define SURFSIG_DOUBT_LITTLE_OVERLAP 4

/**
 * A doubt: the overlap does not determine all motions.
 */
#define SURFSIG_DOUBT_FREE_DIRECTIONS 8

/**
 * A doubt: points of one scan lie where the other's sensor looked through.
 */
#define SURFSIG_DOUBT_FREE_SPACE 16

/**
 * A doubt: other transforms explain as much.
 */
#define SURFSIG_DOUBT_AMBIGUOUS 32

/**
 * A doubt: the source is larger or smaller than the target.
 */
#define SURFSIG_DOUBT_SCALE 64

/**
 * A doubt: the source's mirror image fits better.
 */
#define SURFSIG_DOUBT_MIRRORED 128

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
   * The operating system refused threads or memory.
   */
  SURFSIG_CODE_SYSTEM = 2,
  /**
   * A bug in surfsig: please report it with the text of surfsig_last_error().
   */
  SURFSIG_CODE_INTERNAL = 3,
  /**
   * The points do not determine what was to be fitted: they are too few, or lie on a curve.
   */
  SURFSIG_CODE_UNDETERMINED = 4,
  /**
   * The progress function asked to stop.
   */
  SURFSIG_CODE_CANCELLED = 5,
} surfsig_code;

/**
 * Why a scan has the pose that it has.
 */
enum surfsig_scan_status
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * Found next to where it was expected.
   */
  SURFSIG_SCAN_STATUS_TRACKED = 0,
  /**
   * Found by the signatures of its keypoints, after tracking had failed.
   */
  SURFSIG_SCAN_STATUS_RELOCALISED = 1,
  /**
   * Not found: no pose.
   */
  SURFSIG_SCAN_STATUS_LOST = 2,
  /**
   * It has hardly any points: no pose.
   */
  SURFSIG_SCAN_STATUS_TOO_FEW_POINTS = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum surfsig_scan_status surfsig_scan_status;
#else
typedef uint8_t surfsig_scan_status;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * What a surface is, or a curve.
 */
enum surfsig_surface_kind
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * A plane.
   */
  SURFSIG_SURFACE_KIND_PLANE = 0,
  /**
   * A sphere.
   */
  SURFSIG_SURFACE_KIND_SPHERE = 1,
  /**
   * A circular cylinder.
   */
  SURFSIG_SURFACE_KIND_CYLINDER = 2,
  /**
   * A circular cone, one nappe of it.
   */
  SURFSIG_SURFACE_KIND_CONE = 3,
  /**
   * A torus.
   */
  SURFSIG_SURFACE_KIND_TORUS = 4,
  /**
   * A circle in space: only surfsig_fit_primitive() takes it.
   */
  SURFSIG_SURFACE_KIND_CIRCLE = 5,
  /**
   * A straight line: only surfsig_fit_primitive() takes it.
   */
  SURFSIG_SURFACE_KIND_LINE = 6,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum surfsig_surface_kind surfsig_surface_kind;
#else
typedef uint8_t surfsig_surface_kind;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

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
   * The axes did not converge: the values are those of the last iteration. Typical of edges, corners and
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
 * Which surface is fitted to the points of a neighbourhood.
 */
typedef enum {
  /**
   * The paper's paraboloid, eq. (5): the smallest spread, and a bias where the ball is not small against the radius
   * of curvature.
   */
  SURFSIG_FIT_PARABOLOID = 0,
  /**
   * A general quadric with Taubin's normalisation: exact on spheres, cylinders, cones and ellipsoids of any size,
   * where they rise out of the noise; the paraboloid elsewhere.
   */
  SURFSIG_FIT_QUADRIC = 1,
  /**
   * For each query what errs less.
   */
  SURFSIG_FIT_AUTO = 2,
} surfsig_fit;

/**
 * Whose curvature a query has.
 */
enum surfsig_fit_used
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * There is no curvature.
   */
  SURFSIG_FIT_USED_NONE = 0,
  /**
   * The paraboloid's.
   */
  SURFSIG_FIT_USED_PARABOLOID = 1,
  /**
   * The quadric's.
   */
  SURFSIG_FIT_USED_QUADRIC = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum surfsig_fit_used surfsig_fit_used;
#else
typedef uint8_t surfsig_fit_used;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Points of the caller's. Made by surfsig_cloud_new_f32() or surfsig_cloud_new_f64(), freed by
 * surfsig_cloud_free().
 *
 * Packed points are used where they are: they must neither change nor go as long as the cloud is used. Points with
 * other bytes between them are copied.
 */
typedef struct surfsig_cloud surfsig_cloud;

/**
 * What an extraction gives: columns of one length, in the order of the queries. Made by surfsig_extract() and the
 * like, freed by surfsig_extraction_free(). It refers to nothing of the caller's.
 */
typedef struct surfsig_extraction surfsig_extraction;

/**
 * How models are prepared and looked for. Made by surfsig_find_options_new(), freed by surfsig_find_options_free().
 */
typedef struct surfsig_find_options surfsig_find_options;

/**
 * All instances in a scene, the best first. Made by surfsig_find_instances(), freed by surfsig_instances_free(). It
 * refers to nothing of the caller's.
 */
typedef struct surfsig_instances surfsig_instances;

/**
 * What is looked for, prepared once. Made by surfsig_model_new(), freed by surfsig_model_free(). It refers to nothing
 * of the caller's, and may be looked for by several threads at once.
 */
typedef struct surfsig_model surfsig_model;

/**
 * A sensor that is followed from scan to scan. Made by surfsig_odometry_new(), freed by surfsig_odometry_free(). It
 * refers to nothing of the caller's.
 */
typedef struct surfsig_odometry surfsig_odometry;

/**
 * How an extraction is done. Made by surfsig_options_new(), freed by surfsig_options_free().
 */
typedef struct surfsig_options surfsig_options;

/**
 * A plane, sphere, cylinder, cone or torus without a boundary, a circle or a line. Made by surfsig_fit_primitive(),
 * freed by surfsig_primitive_free(). It refers to nothing of the caller's.
 */
typedef struct surfsig_primitive surfsig_primitive;

/**
 * What is known of a surface before surfsig_fit_primitive_with() fits it. Made by surfsig_primitive_options_new(), freed
 * by surfsig_primitive_options_free().
 */
typedef struct surfsig_primitive_options surfsig_primitive_options;

/**
 * How scans are registered. Made by surfsig_registration_options_new(), freed by surfsig_registration_options_free().
 */
typedef struct surfsig_registration_options surfsig_registration_options;

/**
 * How surfaces are found. Made by surfsig_surface_options_new(), freed by surfsig_surface_options_free().
 */
typedef struct surfsig_surface_options surfsig_surface_options;

/**
 * The surfaces of a scan, the one with most points first: columns of one length, and for each point of the cloud the
 * number of its surface. Made by surfsig_find_surfaces(), freed by surfsig_surfaces_free(). It refers to nothing of
 * the caller's.
 */
typedef struct surfsig_surfaces surfsig_surfaces;

/**
 * Told how far work is, some twenty times a second, by the thread that called surfsig; the work itself is done by
 * others meanwhile. Must return, neither by an exception nor by longjmp().
 *
 * @param data What was given with the function.
 * @param done How much is done.
 * @param total Of how much; the same for all calls.
 * @return 0 to go on; anything else stops the work, whose function then returns SURFSIG_CODE_CANCELLED.
 */
typedef int (*surfsig_progress)(void *data, size_t done, size_t total);

/**
 * A scan: its points, and what is known of where they were seen from.
 */
typedef struct {
  /**
   * The points.
   */
  const surfsig_cloud *cloud;
  /**
   * Where the sensor stood, in the cloud's coordinates: 3 doubles, finite; null where nobody knows.
   */
  const double *viewpoint;
  /**
   * In place of a viewpoint: for each point a vector of any length to the side from which it was seen, such as its
   * normal, (count, 3) floats, packed; null for none. Models and scenes in which they are looked for may have both.
   */
  const float *directions;
} surfsig_scan;

/**
 * A rotation and a translation: a point p of the source is at R p + t of the target. Written T_target_source, so that
 * T_a_b T_b_c = T_a_c.
 *
 * The matrix is that of Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(transform.matrix), and its
 * transpose that of a column-major matrix. A twist is a rotation vector in radians, and then a translation.
 */
typedef struct {
  /**
   * R and t, and 0, 0, 0, 1: 4 x 4, row by row.
   */
  double matrix[16];
} surfsig_transform;

/**
 * A motion that does not change a surface, so that a transform of it is not determined in that direction.
 */
typedef struct {
  /**
   * Unit vector along a translation or a rotation's axis; NaN for rotations about every axis through the point.
   */
  double axis[3];
  /**
   * A point on the rotation's axis; NaN for a translation.
   */
  double point[3];
} surfsig_free_direction;

/**
 * A model that is in a scene.
 */
typedef struct {
  /**
   * The model's number among those that were looked for, from 0.
   */
  size_t model;
  /**
   * Takes the model's points to the scene.
   */
  surfsig_transform T_scene_model;
  /**
   * Of the small twist (rotation vector in radians, then translation) in the scene's axes, about the center, that
   * takes the given transform to the true one: 6 x 6, row by row.
   */
  double covariance[36];
  /**
   * Middle of what lies on the scene's points, in the scene's coordinates.
   */
  double center[3];
  /**
   * Probability that the transform is right: within a tenth of the model's diameter. Learnt on simulated scenes.
   */
  double score;
  /**
   * Share of the surface facing the sensor that is seen, 0 to 1; of all of it where the viewpoint is not known.
   */
  double visible;
  /**
   * Share of the model's whole surface that lies on the scene's, 0 to 1.
   */
  double overlap;
  /**
   * Root mean square of the distances there, in the scans' unit.
   */
  double rms;
  /**
   * Number of free directions.
   */
  size_t free_direction_count;
  /**
   * Motions of the model, in the scene's coordinates, that what is seen does not determine; NaN beyond the last.
   */
  surfsig_free_direction free_directions[SURFSIG_FREE_DIRECTIONS];
  /**
   * Number of the scene's points that are the instance's.
   */
  size_t point_count;
} surfsig_instance;

/**
 * A sphere, in the coordinates of the moments.
 */
typedef struct {
  /**
   * x, y, z of the centre.
   */
  double centre[3];
  /**
   * Radius.
   */
  double radius;
  /**
   * Root mean square of the points' distances, to first order.
   */
  double residual;
} surfsig_sphere;

/**
 * A cylinder, in the coordinates of the moments.
 */
typedef struct {
  /**
   * Unit vector along the axis; the sign means nothing.
   */
  double axis[3];
  /**
   * The point of the axis next to the points' mean.
   */
  double centre[3];
  /**
   * Radius.
   */
  double radius;
  /**
   * Root mean square of the points' distances, to first order.
   */
  double residual;
} surfsig_cylinder;

/**
 * The surface Q = 0 of a polynomial of second degree, in the coordinates of the moments.
 */
typedef struct {
  /**
   * Of 1, x, y, z, xx, xy, xz, yy, yz, zz. The mean square of the gradient over the points is 1, so that Q is about
   * the distance from the surface.
   */
  double coefficients[10];
  /**
   * Root mean square of the points' distances, to first order.
   */
  double residual;
  /**
   * By how much the next best quadric's mean square exceeds this one's, less where points are few. Below 4, as on a
   * plane, the points do not tell which quadric they lie on.
   */
  double gap;
  /**
   * Root mean square of the points' distances from their mean.
   */
  double extent;
} surfsig_quadric;

/**
 * What a surface is at one of its points.
 */
typedef struct {
  /**
   * Where it is.
   */
  double position[3];
  /**
   * Unit normal, along the gradient of Q.
   */
  double normal[3];
  /**
   * Larger principal curvature; positive where the surface falls away from the normal.
   */
  double k1;
  /**
   * Smaller principal curvature.
   */
  double k2;
  /**
   * Unit tangent along k1; the sign means nothing.
   */
  double direction[3];
} surfsig_surface_point;

/**
 * A scan's pose in the map, whose frame is that of the first scan that has one.
 */
typedef struct {
  /**
   * Why the pose is what it is.
   */
  surfsig_scan_status status;
  /**
   * Share of the scan's points that lie on the map; 0 where there is no pose.
   */
  double overlap;
  /**
   * Takes the scan's points to the map; NaN where there is no pose.
   */
  surfsig_transform T_map_scan;
  /**
   * Of the twist m (rotation vector in radians, then translation) in the scan's own axes by which the pose is off,
   * T_true = T_map_scan exp(m): 6 x 6, row by row. NaN where there is no pose; infinite in the entries of motions that
   * nothing has determined since the first scan.
   */
  double covariance[36];
  /**
   * Number of motions that the map does not determine for this scan: along them the last motion goes on.
   */
  size_t free_direction_count;
  /**
   * These motions, in the scan's coordinates.
   */
  surfsig_free_direction free_directions[SURFSIG_FREE_DIRECTIONS];
} surfsig_scan_pose;

/**
 * How a source lies in a target, and how sure that is.
 */
typedef struct {
  /**
   * Whether a transform was found; otherwise it and its covariance are NaN.
   */
  bool found;
  /**
   * Whether the transform is right, by what was seen: no test has refuted it.
   */
  bool trusted;
  /**
   * Why it is not trusted: the sum of the SURFSIG_DOUBT_... that hold; 0 where it is.
   */
  uint32_t doubts;
  /**
   * Takes the source's points to the target.
   */
  surfsig_transform T_target_source;
  /**
   * Of the small twist (rotation vector in radians, then translation) in the target's axes, about the center, that
   * takes the given transform to the true one: 6 x 6, row by row.
   */
  double covariance[36];
  /**
   * Middle of the overlap, in the target's coordinates.
   */
  double center[3];
  /**
   * Number of free directions.
   */
  size_t free_direction_count;
  /**
   * Motions of the source, in the target's coordinates, that the overlap does not determine; NaN beyond the last.
   */
  surfsig_free_direction free_directions[SURFSIG_FREE_DIRECTIONS];
  /**
   * Keypoints that were matched; 0 where a start was given.
   */
  size_t matches;
  /**
   * Those of them that agree with the transform.
   */
  size_t inliers;
  /**
   * Share of the source's surface that lies on the target's, 0 to 1.
   */
  double overlap;
  /**
   * The same, where points count the more the nearer they are.
   */
  double explained;
  /**
   * The larger share of one scan's points that lie where the other's sensor looked through; NaN where no viewpoint
   * is known from which all was seen.
   */
  double free_space;
  /**
   * How many times as large as the target the source is; NaN where the overlap does not determine it.
   */
  double scale;
  /**
   * Its standard error.
   */
  double scale_standard_error;
  /**
   * Number of alternatives.
   */
  size_t alternative_count;
  /**
   * Other transforms that explain as much; NaN beyond the last.
   */
  surfsig_transform alternatives[SURFSIG_ALTERNATIVES];
  /**
   * Root mean square of the distances there, in the scans' unit.
   */
  double rms;
  /**
   * Of the patches that were matched, in the scans' unit.
   */
  double radius;
} surfsig_registration;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * The library's version, "major.minor.patch"; null-terminated, never to be freed.
 */
const char *surfsig_version(void);

/**
 * Makes a cloud of points in single precision.
 *
 * Points that are not finite keep their numbers, belong to no neighbourhood, and get SURFSIG_STATUS_NOT_FINITE.
 *
 * @param points x of the first point; its y and z follow it. May have any alignment; null only if count is 0.
 * @param count Number of points, at most 4294967295.
 * @param stride Bytes from one point's x to the next one's, at least 12: 12 for packed coordinates,
 * sizeof(pcl::PointXYZ) and the like otherwise.
 * @param origin x, y, z that are added to each point, finite; null for 0, 0, 0.
 * @param cloud Where the result is put; null is put there where the call fails.
 */
surfsig_code surfsig_cloud_new_f32(const float *points,
                                   size_t count,
                                   size_t stride,
                                   const double *origin,
                                   surfsig_cloud **cloud);

/**
 * Makes a cloud of points in double precision, as surfsig_cloud_new_f32() does; the stride is at least 24 bytes.
 *
 * @param points x of the first point; its y and z follow it. May have any alignment; null only if count is 0.
 * @param count Number of points, at most 4294967295.
 * @param stride Bytes from one point's x to the next one's.
 * @param origin x, y, z that are added to each point, finite; null for 0, 0, 0.
 * @param cloud Where the result is put; null is put there where the call fails.
 */
surfsig_code surfsig_cloud_new_f64(const double *points,
                                   size_t count,
                                   size_t stride,
                                   const double *origin,
                                   surfsig_cloud **cloud);

/**
 * Number of points; 0 for null.
 */
size_t surfsig_cloud_size(const surfsig_cloud *cloud);

/**
 * Median distance of a finite point to its nearest other one; of many points, by a fixed choice of them. 0 for null,
 * and where no point has another. A radius of 5 to 10 times that is a start.
 */
double surfsig_cloud_spacing(const surfsig_cloud *cloud);

/**
 * Frees a cloud, not the points; does nothing with null.
 */
void surfsig_cloud_free(surfsig_cloud *cloud);

/**
 * One line about the last call of this thread that failed; empty where none has. Never to be freed; valid
 * until the thread's next call that fails.
 */
const char *surfsig_last_error(void);

/**
 * Extracts curvature from the points within a radius; eq. (5) of the paper, and from it k1 and k2.
 *
 * A cloud without points gives an extraction of size 0.
 *
 * @param cloud The points.
 * @param radius Radius of the ball around each query, in the cloud's unit; finite and above 0.
 * @param options How, and at which queries; null for the default: at every point.
 * @param extraction Where the result is put; null is put there where the call fails.
 */
surfsig_code surfsig_extract(const surfsig_cloud *cloud,
                             double radius,
                             const surfsig_options *options,
                             surfsig_extraction **extraction);

/**
 * Extracts curvature from the nearest points of each query, as surfsig_extract() does.
 *
 * @param cloud The points.
 * @param neighbors How many, the query itself included where it is a point of the cloud; at least 1.
 * @param options How, and at which queries; null for the default.
 * @param extraction Where the result is put; null is put there where the call fails.
 */
surfsig_code surfsig_extract_nearest(const surfsig_cloud *cloud,
                                     uint32_t neighbors,
                                     const surfsig_options *options,
                                     surfsig_extraction **extraction);

/**
 * Extracts curvature from balls whose radius each query chooses, as surfsig_extract() does: of the radii 2^(i/2), in
 * the cloud's unit, the largest that the fit still explains. In the surface's axes only.
 *
 * @param cloud The points.
 * @param options How, and at which queries; null for the default.
 * @param extraction Where the result is put; null is put there where the call fails.
 */
surfsig_code surfsig_extract_auto_radius(const surfsig_cloud *cloud,
                                         const surfsig_options *options,
                                         surfsig_extraction **extraction);

/**
 * Extracts curvature from balls of several radii, in one pass over the points. Values differ from those of
 * surfsig_extract() with one radius by rounding only.
 *
 * @param cloud The points.
 * @param radii Radii of the balls, (count), in the cloud's unit; each finite and above 0.
 * @param count How many; 0 does nothing.
 * @param options How, and at which queries; null for the default.
 * @param extractions Where the results are put, (count), one for each radius in their order, each to be freed; null
 * is put there where the call fails.
 */
surfsig_code surfsig_extract_radii(const surfsig_cloud *cloud,
                                   const double *radii,
                                   size_t count,
                                   const surfsig_options *options,
                                   surfsig_extraction **extractions);

/**
 * Frees an extraction and its columns; does nothing with null.
 */
void surfsig_extraction_free(surfsig_extraction *extraction);

/**
 * Number of queries, which is the length of each column; 0 for null.
 */
size_t surfsig_extraction_size(const surfsig_extraction *extraction);

/**
 * Radius of the balls; of nearest neighbours and of radii that queries chose, of the largest ball that was looked
 * through. NaN for null.
 */
double surfsig_extraction_radius(const surfsig_extraction *extraction);

/**
 * 1 where a viewpoint or normals say on which side the sensor was; 0 where the side of each normal, and with it the
 * sign of curvature, is a convention, and for null.
 */
int surfsig_extraction_oriented(const surfsig_extraction *extraction);

/**
 * Makes options of the default values: instances with a score of 0.5 at least, all cores.
 */
surfsig_find_options *surfsig_find_options_new(void);

/**
 * Frees options; does nothing with null.
 */
void surfsig_find_options_free(surfsig_find_options *options);

/**
 * Chooses the least score of an instance.
 *
 * @param options The options to change.
 * @param score The probability that the instance's pose is right, above 0 and up to 1; 0 for the default.
 */
surfsig_code surfsig_find_options_set_score(surfsig_find_options *options, double score);

/**
 * Chooses how many instances of all models are given at most: the most probable ones.
 *
 * @param options The options to change.
 * @param at_most How many; 0 for all.
 */
surfsig_code surfsig_find_options_set_at_most(surfsig_find_options *options, size_t at_most);

/**
 * Chooses the number of threads. The result is the same, bit for bit.
 *
 * @param options The options to change.
 * @param threads 1 to 1024; 0 for all cores.
 */
surfsig_code surfsig_find_options_set_threads(surfsig_find_options *options, uint32_t threads);

/**
 * Chooses a function that is told the progress, and may stop the preparation or the search.
 *
 * @param options The options to change.
 * @param progress Called with the number of steps done, and of all; null for none.
 * @param data Given to it; must live as long as the options are used.
 */
surfsig_code surfsig_find_options_set_progress(surfsig_find_options *options,
                                               surfsig_progress progress,
                                               void *data);

/**
 * Prepares a model: a whole object, or one view of it.
 *
 * @param scan Its points, at least 50 finite ones that lie on a surface. May have directions and a viewpoint: then the
 * directions say which side is the outer one. A viewpoint alone says so where all points can have been seen from there.
 * @param options How many threads, and who is told the progress; null for the default.
 * @param model Where the result is put; null is put there where the call fails.
 */
surfsig_code surfsig_model_new(const surfsig_scan *scan,
                               const surfsig_find_options *options,
                               surfsig_model **model);

/**
 * Frees a model; does nothing with null.
 */
void surfsig_model_free(surfsig_model *model);

/**
 * Number of the model's finite points; 0 for null.
 */
size_t surfsig_model_size(const surfsig_model *model);

/**
 * Radius of the smallest patches that describe the model, in its unit: about 0.4 times the median distance of its
 * points from their middle, and about 8 times their spacing at least; NaN for null.
 */
double surfsig_model_radius(const surfsig_model *model);

/**
 * Median distance of the model's points to their nearest other ones, in its unit; NaN for null. Where it is many times
 * that of the scene's points, the two may be in different units.
 */
double surfsig_model_spacing(const surfsig_model *model);

/**
 * Finds every instance of models in a scene. That there is none is no failure.
 *
 * Each place of the scene proposes a transform by the place of a model whose field signature is most similar. Those that
 * many agree on are fitted to the scene's surface and judged by what the sensor saw: what of the model is confirmed by
 * points, less what it saw through and where it saw nothing. The best is taken, with its points, and the others are
 * judged again without these. The result is always the same.
 *
 * @param models What is looked for, each in the scene's unit; null only if count is 0.
 * @param count How many they are.
 * @param scene The scene; it may have directions and a viewpoint. Free space counts where all points can have been seen
 * from the viewpoint, or from the origin of the scene's coordinates where none is given; otherwise only what is
 * confirmed does, and a higher score leaves out what is there by chance. Points at (0, 0, 0), as sensors write them
 * where they measured nothing, must not be among its points: NaN may.
 * @param options How; null for the default.
 * @param instances Where the result is put; null is put there where the call fails.
 */
surfsig_code surfsig_find_instances(const surfsig_model *const *models,
                                    size_t count,
                                    const surfsig_scan *scene,
                                    const surfsig_find_options *options,
                                    surfsig_instances **instances);

/**
 * Frees instances and their indices; does nothing with null.
 */
void surfsig_instances_free(surfsig_instances *instances);

/**
 * Number of instances; 0 for null.
 */
size_t surfsig_instances_size(const surfsig_instances *instances);

/**
 * Gives an instance.
 *
 * @param instances The instances.
 * @param index Number of an instance, from 0.
 * @param instance Where the result is put.
 */
surfsig_code surfsig_instances_get(const surfsig_instances *instances,
                                   size_t index,
                                   surfsig_instance *instance);

/**
 * Numbers of the scene's points that are an instance's, ascending: (point_count) numbers that live as long as the
 * instances. Null for an instance that is none.
 *
 * @param instances The instances.
 * @param index Number of an instance, from 0.
 */
const uint32_t *surfsig_instances_indices(const surfsig_instances *instances,
                                          size_t index);

/**
 * The name of a surfsig_surface_kind, such as "cylinder"; null for a number that is none. Never to be freed.
 */
const char *surfsig_surface_kind_name(uint8_t kind);

/**
 * Number of a surface's parameters, 3 to 7, which its covariance has rows and columns; 0 for a number that is no
 * surfsig_surface_kind.
 *
 * In the order of the covariance: a plane's offset along its normal and the normal's tilts; a sphere's centre and
 * radius; of all others the offsets of the point, the tilts of the axis, and then the radius (cylinder), the radius
 * and the half angle (cone), the offset along the axis, the major radius and the tube's radius (torus), the offset
 * along the axis and the radius (circle); a line has no more. Offsets and tilts are along the two directions across the
 * axis.
 */
size_t surfsig_surface_kind_parameters(uint8_t kind);

/**
 * Sums x^i y^j z^k with i + j + k <= 4 over points, from which surfaces are read off. The moments of two sets of
 * points about one centre add, number by number. Points that are not finite are left out.
 *
 * @param cloud The points.
 * @param centre x, y, z, finite, that are taken from each point before: near the points, for digits are lost with the
 * fourth power of its distance over their extent. Null for 0, 0, 0.
 * @param moments Where the sums are put, SURFSIG_MOMENTS doubles, by order, and within an order as 1, x, y, z are
 * multiplied out: 1, x, y, z, xx, xy, xz, yy, yz, zz, xxx, ...
 */
surfsig_code surfsig_moments(const surfsig_cloud *cloud,
                             const double *centre,
                             double *moments);

/**
 * Fits a sphere with Taubin's normalisation: exact on points of a sphere, and hardly biased by noise.
 *
 * SURFSIG_CODE_UNDETERMINED for fewer than 4 points, for points of a circle, and for a plane.
 *
 * @param moments SURFSIG_MOMENTS doubles, about a centre near the points.
 * @param sphere Where the result is put, in coordinates about that centre.
 */
surfsig_code surfsig_fit_sphere(const double *moments, surfsig_sphere *sphere);

/**
 * Fits a cylinder with Taubin's normalisation: exact on points of a cylinder, and hardly biased by noise.
 *
 * SURFSIG_CODE_UNDETERMINED for fewer than 5 points, for points of a plane, and where no axis converges.
 *
 * @param moments SURFSIG_MOMENTS doubles, about a centre near the points.
 * @param cylinder Where the result is put, in coordinates about that centre.
 */
surfsig_code surfsig_fit_cylinder(const double *moments, surfsig_cylinder *cylinder);

/**
 * Fits a general quadric with Taubin's normalisation: exact on points that lie on a quadric.
 *
 * SURFSIG_CODE_UNDETERMINED for fewer than 9 points, and where the fit does not converge.
 *
 * @param moments SURFSIG_MOMENTS doubles, about a centre near the points.
 * @param quadric Where the result is put, in coordinates about that centre.
 */
surfsig_code surfsig_fit_quadric(const double *moments, surfsig_quadric *quadric);

/**
 * Says what a quadric's surface is where it is nearest to a position.
 *
 * SURFSIG_CODE_UNDETERMINED where no point of the surface is the nearest, as from a sphere's centre.
 *
 * @param quadric The quadric, with an extent above 0.
 * @param from x, y, z of the position, finite.
 * @param point Where the result is put.
 */
surfsig_code surfsig_quadric_nearest(const surfsig_quadric *quadric,
                                     const double *from,
                                     surfsig_surface_point *point);

/**
 * A status in words, as "tracked"; null for a number that is none. Null-terminated, never to be freed.
 */
const char *surfsig_scan_status_name(uint8_t status);

/**
 * Begins a sequence.
 *
 * @param voxel Edge of the voxels in which scans and map are thinned, in the scans' unit; 0 to take it from the first
 * scan.
 * @param max_correspondence_distance Largest distance between points that correspond, in the scans' unit; 0 to take it
 * from how far off the last predictions were.
 * @param map_range How far the map goes around the sensor, in the scans' unit; 0 to take it from the scans.
 * @param threads 1 to 1024; 0 for all cores. The result is the same, bit for bit.
 * @param odometry Where the result is put; null is put there where the call fails.
 */
surfsig_code surfsig_odometry_new(double voxel,
                                  double max_correspondence_distance,
                                  double map_range,
                                  uint32_t threads,
                                  surfsig_odometry **odometry);

/**
 * Ends a sequence; does nothing with null.
 */
void surfsig_odometry_free(surfsig_odometry *odometry);

/**
 * Takes the next scan, in its own frame, in which the sensor is at the viewpoint, or at 0 where none is given.
 *
 * A scan that is lost may still get a pose by the next ones: surfsig_odometry_pose() then gives it.
 *
 * @param odometry The sequence.
 * @param scan The scan; its directions are not looked at.
 * @param pose Where the scan's result is put; null where nobody wants it.
 */
surfsig_code surfsig_odometry_push(surfsig_odometry *odometry,
                                   const surfsig_scan *scan,
                                   surfsig_scan_pose *pose);

/**
 * Takes the next scan of a sensor that moves while it scans: points are taken to where they would have been measured at
 * the time of the pose, by a constant twist that is refined with the pose.
 *
 * @param odometry The sequence.
 * @param scan The scan; its directions are not looked at.
 * @param times Of each point, from the time of the pose on, in intervals from this scan to the next one: -0.5 to 0.5 for
 * a sensor that scans all along, and a pose at the middle. What is not finite counts as 0.
 * @param pose Where the scan's result is put; null where nobody wants it.
 */
surfsig_code surfsig_odometry_push_timed(surfsig_odometry *odometry,
                                         const surfsig_scan *scan,
                                         const double *times,
                                         surfsig_scan_pose *pose);

/**
 * Number of the map that a scan's pose is in, from 0: where a sensor stays lost, another map is begun, whose frame is
 * that of its first scan. -1 for a scan without a pose, one that there is not, and null.
 */
int64_t surfsig_odometry_segment(const surfsig_odometry *odometry,
                                 size_t index);

/**
 * Gives the twist (rotation vector in radians, then translation) in a scan's own axes by which the sensor moves from
 * that scan to the next one, if its motion goes on: NaN where no times of points were given, and where there is no pose.
 *
 * @param odometry The sequence.
 * @param index Number of a scan, from 0.
 * @param twist Room for 6 doubles.
 */
surfsig_code surfsig_odometry_twist(const surfsig_odometry *odometry,
                                    size_t index,
                                    double *twist);

/**
 * Number of scans so far; 0 for null.
 */
size_t surfsig_odometry_size(const surfsig_odometry *odometry);

/**
 * Edge of the voxels in which scans and map are thinned, in the scans' unit; NaN before a scan has points, and for
 * null.
 */
double surfsig_odometry_voxel(const surfsig_odometry *odometry);

/**
 * Gives what is known now of any scan so far.
 *
 * @param odometry The sequence.
 * @param index Number of a scan, from 0.
 * @param pose Where the result is put.
 */
surfsig_code surfsig_odometry_pose(const surfsig_odometry *odometry, size_t index, surfsig_scan_pose *pose);

/**
 * Takes the points of a scan to where they would have been measured at the time of its pose: exp(t m) p, with the
 * sensor's twist m in a unit of time, and each point's time t in that unit.
 *
 * @param cloud The scan's points.
 * @param times Of each point, from the time of the pose on. A point whose time is not finite stays.
 * @param twist A rotation vector in radians, and a translation: 6 doubles, finite, as those of surfsig_odometry_twist(),
 * which are for an interval between scans.
 * @param points Room for (n, 3) doubles, packed: offsets from the cloud's origin. Not a number for points that are not
 * finite.
 */
surfsig_code surfsig_deskew(const surfsig_cloud *cloud,
                            const double *times,
                            const double *twist,
                            double *points);

/**
 * Makes options of the default values: paraboloids in the surface's axes, no viewpoint, all cores, every point.
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
 * Chooses which surface is fitted; only paraboloids in the sensor's axes.
 *
 * @param options The options to change.
 * @param fit A surfsig_fit; any other number is SURFSIG_CODE_INVALID_INPUT.
 */
surfsig_code surfsig_options_set_fit(surfsig_options *options, int fit);

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
 * Gives normals that are known, in place of a viewpoint: they choose the side of the fitted normals and nothing
 * else. Their length does not matter; one that is zero or not finite says nothing.
 *
 * @param options The options to change.
 * @param normals x, y, z of each normal, (count, 3), packed; they are copied. Null for none.
 * @param count How many they are: one for each point of the cloud, or for each position where positions are asked
 * for; another number is an error of the extraction.
 */
surfsig_code surfsig_options_set_normals(surfsig_options *options,
                                         const float *normals,
                                         size_t count);

/**
 * Chooses the number of threads. The result is the same, bit for bit.
 *
 * @param options The options to change.
 * @param threads 1 to 1024; 0 for all cores.
 */
surfsig_code surfsig_options_set_threads(surfsig_options *options, uint32_t threads);

/**
 * Counts only the nearest of the points within the radius of surfsig_extract(); an error of the other extractions.
 *
 * @param options The options to change.
 * @param neighbors At most this many, the query itself included; 0 for all of them.
 */
surfsig_code surfsig_options_set_neighbors(surfsig_options *options,
                                           uint32_t neighbors);

/**
 * Leaves out points farther from the fitted surface than three standard deviations of the others, and
 * fits again, until none is left out or comes back; the count is then that of the points that stay.
 *
 * @param options The options to change.
 * @param robust 1 to do so, 0 (the default) not to.
 */
surfsig_code surfsig_options_set_robust(surfsig_options *options, int robust);

/**
 * Asks for curvature at every point of the cloud, as new options do.
 */
surfsig_code surfsig_options_set_all(surfsig_options *options);

/**
 * Asks for curvature at some points; the others are neighbours only. An index that the cloud does not have is an
 * error of the extraction.
 *
 * @param options The options to change.
 * @param indices Numbers of points, from 0; they are copied. Null only if count is 0.
 * @param count How many they are; 0 asks for no point at all.
 */
surfsig_code surfsig_options_set_indices(surfsig_options *options,
                                         const uint32_t *indices,
                                         size_t count);

/**
 * Asks for curvature at positions that need not be points of the cloud.
 *
 * @param options The options to change.
 * @param positions x, y, z of each in the cloud's coordinates, (count, 3), packed; they are copied. Null only if
 * count is 0.
 * @param count How many they are.
 */
surfsig_code surfsig_options_set_positions(surfsig_options *options,
                                           const double *positions,
                                           size_t count);

/**
 * Asks for curvature at one point of each voxel that holds any, the one nearest to the mean of the voxel's points;
 * surfsig_extraction_indices() says which they are.
 *
 * @param options The options to change.
 * @param voxel Edge of the voxels, in the cloud's unit; finite and above 0.
 */
surfsig_code surfsig_options_set_voxel(surfsig_options *options,
                                       double voxel);

/**
 * Chooses a function that is told the progress, and may stop the extraction.
 *
 * @param options The options to change.
 * @param progress Called with the number of queries that are done and of all, each counted once for each radius;
 * null for none.
 * @param data Given to it; must live as long as the options are used.
 */
surfsig_code surfsig_options_set_progress(surfsig_options *options,
                                          surfsig_progress progress,
                                          void *data);

/**
 * Fits a surface to points: the sum of squared orthogonal distances is least.
 *
 * SURFSIG_CODE_UNDETERMINED where the points are no more than the surface's parameters, do not determine all of them
 * (those of a circle no sphere), or are not all finite.
 *
 * @param cloud The points.
 * @param kind A surfsig_surface_kind; any other number is SURFSIG_CODE_INVALID_INPUT.
 * @param start A surface of the same kind near the points, from which the fit begins; null to begin from what the
 * points tell.
 * @param primitive Where the result is put; null is put there where the call fails.
 */
surfsig_code surfsig_fit_primitive(const surfsig_cloud *cloud,
                                   uint8_t kind,
                                   const surfsig_primitive *start,
                                   surfsig_primitive **primitive);

/**
 * Fits a surface of which something is known, or to points that do not count alike: the sum of weighted squared
 * orthogonal distances is least.
 *
 * SURFSIG_CODE_UNDETERMINED as for surfsig_fit_primitive(); points without weight do not count.
 *
 * @param cloud The points.
 * @param kind A surfsig_surface_kind; any other number is SURFSIG_CODE_INVALID_INPUT.
 * @param options What is known; null for nothing.
 * @param primitive Where the result is put; null is put there where the call fails.
 */
surfsig_code surfsig_fit_primitive_with(const surfsig_cloud *cloud,
                                        uint8_t kind,
                                        const surfsig_primitive_options *options,
                                        surfsig_primitive **primitive);

/**
 * Frees a surface; does nothing with null.
 */
void surfsig_primitive_free(surfsig_primitive *primitive);

/**
 * What it is; SURFSIG_SURFACE_KIND_PLANE for null.
 */
surfsig_surface_kind surfsig_primitive_kind(const surfsig_primitive *primitive);

/**
 * On the plane or the axis, next to the mean of the points; the centre of a sphere or torus: 3 doubles, which live as
 * long as the surface; null for null.
 */
const double *surfsig_primitive_point(const surfsig_primitive *primitive);

/**
 * Unit vector, 3 doubles: a plane's normal, the axis of all others; with a positive z (else y, else x), but along a
 * cone its radius grows. NaN for a sphere; null for null.
 */
const double *surfsig_primitive_axis(const surfsig_primitive *primitive);

/**
 * Of a sphere, cylinder or circle; of a cone at its point; of a torus's tube; NaN for a plane, a line and for null.
 */
double surfsig_primitive_radius(const surfsig_primitive *primitive);

/**
 * Of a torus, from the axis to the middle of the tube; NaN for others and for null.
 */
double surfsig_primitive_major_radius(const surfsig_primitive *primitive);

/**
 * Half the angle at a cone's apex, in radians; NaN for others and for null.
 */
double surfsig_primitive_half_angle(const surfsig_primitive *primitive);

/**
 * Measures how far points are from a surface.
 *
 * @param primitive The surface.
 * @param cloud The points.
 * @param distances Where the signed distances are put, (surfsig_cloud_size()) doubles: positive outside, or where a
 * plane's normal points; NaN for points that are not finite.
 */
surfsig_code surfsig_primitive_distances(const surfsig_primitive *primitive,
                                         const surfsig_cloud *cloud,
                                         double *distances);

/**
 * Says how sure a surface's parameters are, from blocks of neighbouring points, for those of a scanner err alike.
 *
 * @param primitive The surface.
 * @param cloud The points that it was fitted to.
 * @param covariance Where the covariance is put, row by row: (p, p) doubles, with p and the parameters as
 * surfsig_surface_kind_parameters() says, so that 49 are enough for all; NaN where one block of the points is all that
 * determines some.
 * @param across Where two unit vectors across the axis are put, (2, 3) doubles; null if nobody asks.
 * @param freedom Where the degrees of freedom of the radius's variance (a plane's: of the offset's) are put, for
 * Student's t; null if nobody asks.
 */
surfsig_code surfsig_primitive_uncertainty(const surfsig_primitive *primitive,
                                           const surfsig_cloud *cloud,
                                           double *covariance,
                                           double *across,
                                           double *freedom);

/**
 * The same of a surface that surfsig_fit_primitive_with() fitted: what it kept has no variance and no covariance.
 *
 * @param primitive The surface.
 * @param cloud The points that it was fitted to.
 * @param options Those of the fit; null for none. The start means nothing here.
 * @param covariance As for surfsig_primitive_uncertainty().
 * @param across As for surfsig_primitive_uncertainty().
 * @param freedom As for surfsig_primitive_uncertainty().
 */
surfsig_code surfsig_primitive_uncertainty_with(const surfsig_primitive *primitive,
                                                const surfsig_cloud *cloud,
                                                const surfsig_primitive_options *options,
                                                double *covariance,
                                                double *across,
                                                double *freedom);

/**
 * The standard error of a surface's radius (of a plane's offset) that the points' number promises if none err alike;
 * NaN where they do not determine the surface, and for null.
 *
 * @param primitive The surface.
 * @param cloud The points that it was fitted to.
 */
double surfsig_primitive_independent_error(const surfsig_primitive *primitive,
                                           const surfsig_cloud *cloud);

/**
 * Makes options of the default values: everything is fitted, all points count alike.
 */
surfsig_primitive_options *surfsig_primitive_options_new(void);

/**
 * Frees options; does nothing with null.
 */
void surfsig_primitive_options_free(surfsig_primitive_options *options);

/**
 * Chooses the surface from which the fit begins.
 *
 * @param options The options to change.
 * @param start A surface of the same kind near the points, which is copied; null to begin from what the points tell.
 */
surfsig_code surfsig_primitive_options_set_start(surfsig_primitive_options *options,
                                                 const surfsig_primitive *start);

/**
 * Says by how much the squared distance of each point counts, such as one over the variance of its noise. Their common
 * factor means nothing.
 *
 * @param options The options to change.
 * @param weights Finite and not below 0; they are copied. Null for none: all points count alike.
 * @param count How many they are: one for each point of the cloud; another number is an error of the fit.
 */
surfsig_code surfsig_primitive_options_set_weights(surfsig_primitive_options *options,
                                                   const double *weights,
                                                   size_t count);

/**
 * Gives the radius of a sphere, cylinder or circle, where it is known: only the rest is fitted.
 *
 * @param options The options to change.
 * @param radius In the cloud's unit, finite; 0 to have it fitted. With another kind it is an error of the fit.
 */
surfsig_code surfsig_primitive_options_set_radius(surfsig_primitive_options *options,
                                                  double radius);

/**
 * Gives the direction of the axis or normal, where it is known: only the rest is fitted.
 *
 * @param options The options to change.
 * @param axis x, y, z, finite, of any length above 0; null to have it fitted. A sphere has none: it is then an error of
 * the fit.
 */
surfsig_code surfsig_primitive_options_set_axis(surfsig_primitive_options *options,
                                                const double *axis);

/**
 * Makes options of the default values: the radius by the scans' size, 1,000 keypoints, all cores.
 */
surfsig_registration_options *surfsig_registration_options_new(void);

/**
 * Frees options; does nothing with null.
 */
void surfsig_registration_options_free(surfsig_registration_options *options);

/**
 * Chooses the radius of the patches that are matched.
 *
 * @param options The options to change.
 * @param radius In the scans' unit; 0 for the default: 0.4 times the median distance of the points from their middle,
 * of the smaller scan.
 */
surfsig_code surfsig_registration_options_set_radius(surfsig_registration_options *options,
                                                     double radius);

/**
 * Chooses the number of keypoints of each scan.
 *
 * @param options The options to change.
 * @param keypoints At least 1; 0 for the default.
 */
surfsig_code surfsig_registration_options_set_keypoints(surfsig_registration_options *options,
                                                        uint32_t keypoints);

/**
 * Chooses the number of threads. The result is the same, bit for bit.
 *
 * @param options The options to change.
 * @param threads 1 to 1024; 0 for all cores.
 */
surfsig_code surfsig_registration_options_set_threads(surfsig_registration_options *options,
                                                      uint32_t threads);

/**
 * Chooses a function that is told the progress, and may stop the registration.
 *
 * @param options The options to change.
 * @param progress Called with the number of steps done, and of all; null for none.
 * @param data Given to it; must live as long as the options are used.
 */
surfsig_code surfsig_registration_options_set_progress(surfsig_registration_options *options,
                                                       surfsig_progress progress,
                                                       void *data);

/**
 * Finds how a scan lies in another, from any start, without a parameter.
 *
 * Keypoints are matched by their field signatures, the transform that most matches agree with is refined by
 * generalised ICP, and the last steps fit points to the surface, which tells how sure it is. The result is always the
 * same. That nothing was found is no failure: `found` is false then.
 *
 * @param source The scan that is moved.
 * @param target The scan that stays, in the same unit.
 * @param start T_target_source, roughly, which is then refined and not searched; null where nobody knows it.
 * @param options How; null for the default.
 * @param registration Where the result is put.
 */
surfsig_code surfsig_register(const surfsig_scan *source,
                              const surfsig_scan *target,
                              const surfsig_transform *start,
                              const surfsig_registration_options *options,
                              surfsig_registration *registration);

/**
 * Makes the signatures of chosen queries, in the default frame. The first call of a process also makes the
 * frame, in some tens of milliseconds.
 *
 * @param extraction Where the queries' surfaces are.
 * @param queries Numbers of queries, from 0, (count); null for the first count of them.
 * @param count How many; 0 does nothing.
 * @param signatures Where they are put: (count, 242) floats, row by row; NaN where there is none.
 * @param statuses Where it is put why, (count); null if nobody asks.
 */
surfsig_code surfsig_signatures(const surfsig_extraction *extraction,
                                const uint32_t *queries,
                                size_t count,
                                float *signatures,
                                surfsig_status *statuses);

/**
 * Length of a flat atom for surfsig_similarities(): one more coordinate, the same for all signatures, that tells "flat
 * within its error" from "slightly curved". It follows the median standard error of the mean curvature. 0 where no
 * query has one, where the noise is beyond the vocabulary, and for null.
 */
double surfsig_flat_atom_length(const surfsig_extraction *extraction);

/**
 * Compares all queries with one of them: where else its surface is. In the surface's axes.
 *
 * @param extraction Where the queries' surfaces are.
 * @param query Number of a query, from 0.
 * @param flat_atom Length of the flat atom, finite, as surfsig_flat_atom_length() gives it; 0 for none.
 * @param zeta Where zeta of eq. (12) is put, (size) floats: of the more similar side where no viewpoint is known, NaN
 * where there is no signature.
 */
surfsig_code surfsig_similarities(const surfsig_extraction *extraction,
                                  uint32_t query,
                                  double flat_atom,
                                  float *zeta);

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

/**
 * Makes options of the default values: all kinds, noise estimated around each point, all cores.
 */
surfsig_surface_options *surfsig_surface_options_new(void);

/**
 * Frees options; does nothing with null.
 */
void surfsig_surface_options_free(surfsig_surface_options *options);

/**
 * Chooses the fewest points of a surface.
 *
 * @param options The options to change.
 * @param points At least 1; 0 for the default: a five-hundredth of all, from 20 to 1,000, and
 * fewer of surfaces that end at edges.
 */
surfsig_code surfsig_surface_options_set_min_points(surfsig_surface_options *options, uint32_t points);

/**
 * Says how far points are from their surfaces.
 *
 * @param options The options to change.
 * @param noise Standard deviation of the distances, in the cloud's unit, finite; 0 to have it estimated around each
 * point.
 */
surfsig_code surfsig_surface_options_set_noise(surfsig_surface_options *options,
                                               double noise);

/**
 * Chooses which kinds of surfaces are looked for.
 *
 * @param options The options to change.
 * @param kinds Each a surfsig_surface_kind; any other number is SURFSIG_CODE_INVALID_INPUT. Null only if count is 0.
 * @param count How many they are; 0 for all kinds.
 */
surfsig_code surfsig_surface_options_set_kinds(surfsig_surface_options *options,
                                               const uint8_t *kinds,
                                               size_t count);

/**
 * Chooses the number of threads. The result is the same, bit for bit.
 *
 * @param options The options to change.
 * @param threads 1 to 1024; 0 for all cores.
 */
surfsig_code surfsig_surface_options_set_threads(surfsig_surface_options *options, uint32_t threads);

/**
 * Chooses a function that is told the progress, and may stop the search.
 *
 * @param options The options to change.
 * @param progress Called with the number of points that have a surface, and of all; null for none.
 * @param data Given to it; must live as long as the options are used.
 */
surfsig_code surfsig_surface_options_set_progress(surfsig_surface_options *options,
                                                  surfsig_progress progress,
                                                  void *data);

/**
 * Finds the planes, spheres, cylinders, cones and tori of a scan.
 *
 * Surfaces grow from the smoothest points on, over neighbouring points that are within the noise around them; the
 * simplest kind that explains its points wins. The result is always the same.
 *
 * @param cloud The points.
 * @param options How; null for the default.
 * @param surfaces Where the result is put; null is put there where the call fails.
 */
surfsig_code surfsig_find_surfaces(const surfsig_cloud *cloud,
                                   const surfsig_surface_options *options,
                                   surfsig_surfaces **surfaces);

/**
 * Frees surfaces and their columns; does nothing with null.
 */
void surfsig_surfaces_free(surfsig_surfaces *surfaces);

/**
 * Number of surfaces, which is the length of each column; 0 for null.
 */
size_t surfsig_surfaces_size(const surfsig_surfaces *surfaces);

/**
 * Number of points of the cloud, which is the length of the labels; 0 for null.
 */
size_t surfsig_surfaces_label_count(const surfsig_surfaces *surfaces);

/**
 * Of each point of the cloud the number of its surface, or -1, (label count) numbers; null where there is no point.
 */
const int32_t *surfsig_surfaces_labels(const surfsig_surfaces *surfaces);

/**
 * Covariance of a surface's parameters, row by row: (p, p) doubles, with p and the parameters as
 * surfsig_surface_kind_parameters() says. Null where the points do not determine it, and for a surface that is none.
 *
 * @param surfaces The surfaces.
 * @param index Number of a surface, from 0.
 */
const double *surfsig_surfaces_covariance(const surfsig_surfaces *surfaces,
                                          size_t index);

/**
 * The transform that leaves everything where it is.
 */
surfsig_transform surfsig_transform_identity(void);

/**
 * Checks a matrix. R^T R may differ from 1 by 1e-4 in each entry, as that of a printed matrix does: then the nearest
 * rotation is taken. A rotation that is exact within 1e-12 keeps its bits. Every function that takes a transform does
 * the same.
 *
 * @param matrix 16 doubles, row by row, finite, with 0, 0, 0, 1 in the last row; must neither scale, shear nor mirror.
 * @param transform Where the result is put; may be where the matrix is.
 */
surfsig_code surfsig_transform_from_matrix(const double *matrix,
                                           surfsig_transform *transform);

/**
 * Makes a rotation about an axis through 0, and then a translation.
 *
 * @param rotation_vector Along the axis, as long as the angle in radians: 3 doubles, finite; null for none.
 * @param translation 3 doubles, finite; null for none.
 * @param transform Where the result is put.
 */
surfsig_code surfsig_transform_from_rotation_vector(const double *rotation_vector,
                                                    const double *translation,
                                                    surfsig_transform *transform);

/**
 * Makes the transform of a twist: what a motion at this constant velocity, in axes that stay, has made after one unit
 * of time.
 *
 * @param twist A rotation vector in radians, and a translation: 6 doubles, finite.
 * @param transform Where the result is put.
 */
surfsig_code surfsig_transform_exp(const double *twist,
                                   surfsig_transform *transform);

/**
 * Gives the twist whose exponential a transform is, with a rotation of pi at most; at pi one of the two.
 *
 * @param transform The transform.
 * @param twist Where the rotation vector in radians and the translation are put: 6 doubles.
 */
surfsig_code surfsig_transform_log(const surfsig_transform *transform, double *twist);

/**
 * Gives the matrix that takes twists in the source's axes to the same motions in the target's:
 * T exp(twist) T^-1 = exp(Ad twist).
 *
 * @param transform The transform.
 * @param adjoint Where the matrix is put, 6 x 6 doubles, row by row.
 */
surfsig_code surfsig_transform_adjoint(const surfsig_transform *transform, double *adjoint);

/**
 * Multiplies transforms: T_a_b T_b_c = T_a_c, which applies the second one first.
 *
 * @param a_b The transform that is applied last.
 * @param b_c The transform that is applied first.
 * @param a_c Where the product is put; may be one of the two.
 */
surfsig_code surfsig_transform_compose(const surfsig_transform *a_b,
                                       const surfsig_transform *b_c,
                                       surfsig_transform *a_c);

/**
 * Inverts a transform: T_target_source becomes T_source_target.
 *
 * @param transform The transform.
 * @param inverse Where the result is put; may be the transform itself.
 */
surfsig_code surfsig_transform_inverse(const surfsig_transform *transform, surfsig_transform *inverse);

/**
 * Applies a transform to points: R p + t.
 *
 * @param transform The transform.
 * @param points x of the first point; its y and z follow it. May have any alignment; null only if count is 0.
 * @param count Number of points.
 * @param stride Bytes from one point's x to the next one's, at least 24.
 * @param moved Where the results are put, (count, 3) doubles, packed; may be the points themselves where these are
 * packed.
 */
surfsig_code surfsig_transform_points(const surfsig_transform *transform,
                                      const double *points,
                                      size_t count,
                                      size_t stride,
                                      double *moved);

/**
 * Applies a transform to vectors, such as normals: R v, without the translation.
 *
 * @param transform The transform.
 * @param vectors x of the first vector; its y and z follow it. May have any alignment; null only if count is 0.
 * @param count Number of vectors.
 * @param stride Bytes from one vector's x to the next one's, at least 24.
 * @param rotated Where the results are put, (count, 3) doubles, packed; may be the vectors themselves where these are
 * packed.
 */
surfsig_code surfsig_transform_vectors(const surfsig_transform *transform,
                                       const double *vectors,
                                       size_t count,
                                       size_t stride,
                                       double *rotated);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* SURFSIG_H */

#ifdef __cplusplus
extern "C" {
#endif  // __cplusplus

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
 * Root mean square of the points' distances from the fit along its height, (size) floats.
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
 * Points in the ball, the query itself included where it is one of them, (size) numbers.
 */
const uint32_t *surfsig_extraction_count(const surfsig_extraction *extraction);

/**
 * What became of each query, (size) bytes.
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
 * Radius of each query's neighbourhood, (size) floats: of nearest neighbours the distance to the farthest, or
 * the radius that the query chose. Null where all have the same, surfsig_extraction_radius().
 */
const float *surfsig_extraction_radii(const surfsig_extraction *extraction);

/**
 * Whose curvature each query has, (size) bytes. Null where only paraboloids were fitted.
 */
const surfsig_fit_used *surfsig_extraction_fit_used(const surfsig_extraction *extraction);

/**
 * a, b, c, d, e, f of eq. (5) about each query, (size, 6) floats, row by row, with heights that grow away from
 * the sensor. Null in the surface's axes.
 */
const float *surfsig_extraction_coefficients(const surfsig_extraction *extraction);

/**
 * Numbers of the queries in the cloud, (size). Null where the queries are all points in their order, or
 * positions.
 */
const uint32_t *surfsig_extraction_indices(const surfsig_extraction *extraction);

/**
 * X(type, name, width) for each column of a surfsig_extraction: surfsig_extraction_##name() gives it, width values a
 * row.
 */
#define SURFSIG_EXTRACTION_COLUMNS(X) \
  X(float, k1, 1) \
  X(float, k2, 1) \
  X(float, normals, 3) \
  X(float, directions, 3) \
  X(float, residual, 1) \
  X(float, condition, 1) \
  X(float, mean_curvature_std, 1) \
  X(float, k1_std, 1) \
  X(float, k2_std, 1) \
  X(uint32_t, count, 1) \
  X(surfsig_status, status, 1) \
  X(float, linearity, 1) \
  X(float, planarity, 1) \
  X(float, scattering, 1) \
  X(float, radii, 1) \
  X(surfsig_fit_used, fit_used, 1) \
  X(float, coefficients, 6) \
  X(uint32_t, indices, 1)

/**
 * What each surface is, (size) bytes. Like every column it lives as long as the surfaces; null where there are
 * none.
 */
const surfsig_surface_kind *surfsig_surfaces_kind(const surfsig_surfaces *surfaces);

/**
 * On the plane or the axis, near the points; the centre of a sphere or torus: (size, 3) doubles, row by row.
 */
const double *surfsig_surfaces_point(const surfsig_surfaces *surfaces);

/**
 * Unit vectors: a plane's normal, the axis of all others, along which a cone widens, (size, 3) doubles; NaN for a
 * sphere.
 */
const double *surfsig_surfaces_axis(const surfsig_surfaces *surfaces);

/**
 * Of a sphere or cylinder, of a cone at its point, of a torus's tube, (size) doubles; NaN for a plane.
 */
const double *surfsig_surfaces_radius(const surfsig_surfaces *surfaces);

/**
 * Of a torus, from its axis to the middle of its tube, (size) doubles; NaN for others.
 */
const double *surfsig_surfaces_major_radius(const surfsig_surfaces *surfaces);

/**
 * Of a cone, between its axis and its side, in radians, (size) doubles; NaN for others.
 */
const double *surfsig_surfaces_half_angle(const surfsig_surfaces *surfaces);

/**
 * Standard deviation of a point's distance, (size) doubles.
 */
const double *surfsig_surfaces_deviation(const surfsig_surfaces *surfaces);

/**
 * Number of points, (size) numbers.
 */
const uint32_t *surfsig_surfaces_count(const surfsig_surfaces *surfaces);

/**
 * Standard error of the radius, (size) doubles; NaN where the points do not determine it.
 */
const double *surfsig_surfaces_radius_std(const surfsig_surfaces *surfaces);

/**
 * Standard error of the major radius, (size) doubles.
 */
const double *surfsig_surfaces_major_radius_std(const surfsig_surfaces *surfaces);

/**
 * Standard error of the half angle, (size) doubles.
 */
const double *surfsig_surfaces_half_angle_std(const surfsig_surfaces *surfaces);

/**
 * Two unit vectors across the axis, along which the covariance counts offsets and tilts, (size, 2, 3) doubles.
 */
const double *surfsig_surfaces_across(const surfsig_surfaces *surfaces);

/**
 * Degrees of freedom behind the standard errors, for Student's t, (size) doubles.
 */
const double *surfsig_surfaces_freedom(const surfsig_surfaces *surfaces);

/**
 * X(type, name, width) for each column of a surfsig_surfaces: surfsig_surfaces_##name() gives it, width values a
 * row.
 */
#define SURFSIG_SURFACES_COLUMNS(X) \
  X(surfsig_surface_kind, kind, 1) \
  X(double, point, 3) \
  X(double, axis, 3) \
  X(double, radius, 1) \
  X(double, major_radius, 1) \
  X(double, half_angle, 1) \
  X(double, deviation, 1) \
  X(uint32_t, count, 1) \
  X(double, radius_std, 1) \
  X(double, major_radius_std, 1) \
  X(double, half_angle_std, 1) \
  X(double, across, 6) \
  X(double, freedom, 1)

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus
