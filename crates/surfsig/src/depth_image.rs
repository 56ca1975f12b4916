//! What a sensor saw around a piece of a scan, as a depth image; and whether poses of another piece agree.

mod front;

pub(crate) use front::Front;

use crate::geometry::{RigidTransform, axes_across};
use nalgebra::Vector3;

/// Pixels along a side, however dense the scan.
const MOST_PIXELS: f64 = 512.0;
/// Squared pixels around a point of the scan that it speaks for; a pixel is a point spacing wide.
const REACH: i32 = 2;
/// Squared pixels from the next point of the scan up to which something may have been measured.
const LOST: i32 = 6;
/// Cosine between normals that face alike; those of narrow surfaces and of edges are smoothed.
pub(crate) const ALIKE: f32 = 0.8;
/// Tolerances from the surface within which another surface would have been told from it.
const NEARBY: f32 = 4.0;
/// Cosine to the line of sight from which on a surface is not too steep to be measured (65 degrees).
pub(crate) const FACING: f32 = 0.42;

/// A place on a surface, with the unit normal on the sensor's side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePlace {
    /// Where it is.
    pub place: [f32; 3],
    /// Its normal.
    pub normal: [f32; 3],
}

/// What a scan says about surface places that a pose has moved into it: shares of all of them.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Judgement {
    /// On the piece's own surface, facing alike.
    pub confirmed: f32,
    /// Where the sensor saw through, or beneath what supports the piece.
    pub contradicted: f32,
    /// Visible, neither in front nor far behind, but not confirmed: at another angle, or just beneath.
    pub mismatched: f32,
    /// In sight and facing the sensor, but nothing was measured there.
    pub missing: f32,
}

/// Of surface places, how many are what; see [`Judgement`].
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Counts {
    pub confirmed: u32,
    pub contradicted: u32,
    pub mismatched: u32,
    pub missing: u32,
}

impl Counts {
    pub fn add(&mut self, other: &Self) {
        self.confirmed += other.confirmed;
        self.contradicted += other.contradicted;
        self.mismatched += other.mismatched;
        self.missing += other.missing;
    }

    fn shares(&self, of: usize) -> Judgement {
        let share = |count: u32| count as f32 / of.max(1) as f32;
        Judgement {
            confirmed: share(self.confirmed),
            contradicted: share(self.contradicted),
            mismatched: share(self.mismatched),
            missing: share(self.missing),
        }
    }
}

/// A pose into the axes of an image, in single precision.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ImagePose {
    rotation: [[f32; 3]; 3],
    translation: [f32; 3],
}

impl ImagePose {
    fn point(&self, point: &[f32; 3]) -> [f32; 3] {
        let rotated = self.vector(point);
        [0, 1, 2].map(|i| rotated[i] + self.translation[i])
    }

    fn vector(&self, vector: &[f32; 3]) -> [f32; 3] {
        [0, 1, 2].map(|i| dot(&self.rotation[i], vector))
    }
}

/// What is known of a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Seen {
    /// A point of the piece itself.
    Own,
    /// Another point.
    Other,
    /// No point, but one near by: it may be between two.
    Between,
    /// Nothing far around.
    Nothing,
}

#[derive(Debug, Clone, Copy)]
struct Pixel {
    /// The number of the nearest point of the scan.
    point: u32,
    /// The smallest depth in the 3 x 3 pixels around; below all where no point is in the pixel itself, as in
    /// shadows and along rims too steep to be measured.
    front: f32,
    seen: Seen,
}

/// A depth image of a piece and its surroundings from where the sensor stood.
///
/// The origin is the piece's middle; the image plane is square to the line of sight to it.
///
/// ```
/// use surfsig::{DepthImage, RigidTransform, SurfacePlace};
///
/// // A square, one apart, seen from above; the same square, moved on to its side.
/// let square: Vec<SurfacePlace> = (0..400)
///     .map(|i| [(i % 20) as f32 - 9.5, (i / 20) as f32 - 9.5, 0.0])
///     .map(|place| SurfacePlace { place, normal: [0.0, 0.0, 1.0] })
///     .collect();
/// let image = DepthImage::new(&square, &[true; 400], [0.0, 0.0, 1000.0], 1.0, 30.0, None);
/// let moved = |x| RigidTransform::from_rotation_vector([0.0; 3], [x, 0.0, 0.0]);
/// let [there, beside] = [0.0, 15.0].map(|x| image.judge(&moved(x), &square, 0.3));
/// assert_eq!((there.confirmed, there.missing), (1.0, 0.0));
/// assert!(beside.confirmed < 0.4 && beside.missing > 0.5);
/// ```
#[derive(Debug, Clone)]
pub struct DepthImage {
    axes: [[f32; 3]; 3],
    /// From the viewpoint to the origin.
    distance: f32,
    /// Pixels per unit of slope.
    scale: f32,
    side: usize,
    /// Those of the scan that pixels speak of, in the image's axes.
    points: Vec<SurfacePlace>,
    pixels: Vec<Pixel>,
    second_viewpoint: Option<Box<DepthImage>>,
    /// In the image's axes.
    support_planes: Vec<SurfacePlace>,
}

impl DepthImage {
    /// Takes the image of a scan around the origin.
    ///
    /// `points` are those of the scan around a piece and `own` says which are the piece's; `spacing` is between
    /// points; what is farther than `reach` from the line of sight is left out. `second_viewpoint` is another
    /// one that points had to be seen from to be measured, as a triangulation scanner's camera is beside its laser.
    ///
    /// # Panics
    /// If `own` has another length than `points`.
    pub fn new(
        points: &[SurfacePlace],
        own: &[bool],
        viewpoint: [f64; 3],
        spacing: f64,
        reach: f64,
        second_viewpoint: Option<[f64; 3]>,
    ) -> Self {
        assert_eq!(points.len(), own.len(), "one flag for each point");
        let distance = viewpoint.iter().map(|x| x * x).sum::<f64>().sqrt();
        let pixel = spacing.max(2.0 * reach / MOST_PIXELS);
        let side = (2.0 * reach / pixel).ceil() as usize + 1;
        let mut image = Self {
            axes: axes_towards(viewpoint.map(|x| -x / distance)),
            distance: distance as f32,
            scale: (distance / pixel) as f32,
            side,
            points: Vec::new(),
            pixels: Vec::new(),
            second_viewpoint: second_viewpoint
                .map(|other| Box::new(Self::new(points, own, other, spacing, reach, None))),
            support_planes: Vec::new(),
        };
        image.fill(points, own);
        image
    }

    /// Lets planes support the piece, each given by a point and its normal: nothing of the piece is beneath them.
    #[must_use]
    pub fn supported_by(mut self, planes: &[SurfacePlace]) -> Self {
        self.support_planes = planes.iter().map(|plane| self.in_image_axes(plane)).collect();
        self
    }

    /// The image of the mirror image of the scan, x to -x.
    #[must_use]
    pub(crate) fn mirrored(&self) -> Self {
        let second_viewpoint = self.second_viewpoint.as_ref().map(|second| Box::new(second.mirrored()));
        // Everything else is in the image's own axes.
        Self { axes: self.axes.map(|[x, y, z]| [-x, y, z]), second_viewpoint, ..self.clone() }
    }

    fn fill(&mut self, points: &[SurfacePlace], own: &[bool]) {
        let side = self.side;
        let points: Vec<SurfacePlace> = points.iter().map(|point| self.in_image_axes(point)).collect();
        let mut depths = vec![f32::INFINITY; side * side];
        let mut numbers = vec![0_u32; side * side];
        for (number, point) in (0..).zip(&points) {
            if let Some((cell, depth)) = self.project(&point.place)
                && depth < depths[cell]
            {
                (depths[cell], numbers[cell]) = (depth, number);
            }
        }
        let fronts = smallest_around(&depths, side, 1);
        let nearby = smallest_around(&depths, side, 2);
        let mut steps: Vec<(i32, i32, i32)> =
            (-2..=2).flat_map(|dy| (-2..=2).map(move |dx| (dy * dy + dx * dx, dy, dx))).collect();
        steps.retain(|&(squared, ..)| 0 < squared && squared <= LOST);
        steps.sort_unstable();
        let nearest = |cell: usize| {
            let (row, column) = ((cell / side) as i32, (cell % side) as i32);
            let inside = |x: i32| x >= 0 && x < side as i32;
            let found = steps.iter().filter(|(_, dy, dx)| inside(row + dy) && inside(column + dx));
            let mut found = found.map(|&(squared, dy, dx)| (squared, (row + dy) * side as i32 + column + dx));
            found.find(|&(_, other)| depths[other as usize] < f32::INFINITY)
        };
        let pixel = |cell: usize| {
            let seen_by = |point: u32| if own[point as usize] { Seen::Own } else { Seen::Other };
            let nothing = Pixel { point: 0, front: f32::NEG_INFINITY, seen: Seen::Nothing };
            if depths[cell] < f32::INFINITY {
                return Pixel { point: numbers[cell], front: fronts[cell], seen: seen_by(numbers[cell]) };
            }
            if nearby[cell] == f32::INFINITY {
                return nothing;
            }
            let Some((squared, other)) = nearest(cell) else { return nothing };
            let point = numbers[other as usize];
            let seen = if squared <= REACH { seen_by(point) } else { Seen::Between };
            Pixel { point, seen, ..nothing }
        };
        self.pixels = (0..side * side).map(pixel).collect();
        // Most points are behind others, or beside the image.
        let mut places = vec![u32::MAX; points.len()];
        for pixel in self.pixels.iter_mut().filter(|pixel| pixel.seen != Seen::Nothing) {
            let place = &mut places[pixel.point as usize];
            if *place == u32::MAX {
                *place = self.points.len() as u32;
                self.points.push(points[pixel.point as usize]);
            }
            pixel.point = *place;
        }
        self.points.shrink_to_fit();
    }

    fn at(&self, pixel: &Pixel) -> &SurfacePlace {
        &self.points[pixel.point as usize]
    }

    /// Tells what the scan says about surface places that a pose moves into it.
    ///
    /// `tolerance` is the distance within which a place is on a surface.
    pub fn judge(&self, pose: &RigidTransform, places: &[SurfacePlace], tolerance: f32) -> Judgement {
        self.count(&self.to_image(pose), places, tolerance).shares(places.len())
    }

    /// How many of some places are what, under a pose into the image's axes.
    pub(crate) fn count(&self, pose: &ImagePose, places: &[SurfacePlace], tolerance: f32) -> Counts {
        let mut counts = Counts::default();
        for point in places {
            let place = pose.point(&point.place);
            let is_beneath = |plane: &SurfacePlace| plane_distance(plane, &place) < -2.0 * tolerance;
            if self.support_planes.iter().any(is_beneath) {
                counts.contradicted += 1;
                continue;
            }
            let Some((cell, depth)) = self.project(&place) else { continue };
            let pixel = &self.pixels[cell];
            match pixel.seen {
                Seen::Between => {}
                Seen::Nothing => {
                    let normal = pose.vector(&point.normal);
                    counts.missing += u32::from(self.should_be_seen(&place, &normal, tolerance));
                }
                seen => {
                    let own = seen == Seen::Own;
                    let distance = plane_distance(self.at(pixel), &place).abs();
                    if own && distance <= tolerance {
                        let normal = pose.vector(&point.normal);
                        if dot(&normal, &self.at(pixel).normal) > ALIKE {
                            counts.confirmed += 1;
                            // On the surface, however its rim lies before it.
                            counts.contradicted += u32::from(depth < pixel.front - 2.0 * tolerance);
                            continue;
                        }
                    }
                    if depth < pixel.front - 2.0 * tolerance {
                        counts.contradicted += 1;
                    } else if own && distance <= NEARBY * tolerance {
                        counts.mismatched += 1;
                    }
                }
            }
        }
        counts
    }

    /// For places that a pose moves to the piece's surface, or beside it: the points of the piece there, in the
    /// scan's axes; `None` for others.
    pub fn correspondences(
        &self,
        pose: &RigidTransform,
        places: &[SurfacePlace],
        tolerance: f32,
    ) -> Vec<Option<SurfacePlace>> {
        let to_image = self.to_image(pose);
        let found = |point: &SurfacePlace| {
            let place = to_image.point(&point.place);
            let pixel = &self.pixels[self.project(&place)?.0];
            let normal = to_image.vector(&point.normal);
            let near = pixel.seen == Seen::Own
                && plane_distance(self.at(pixel), &place).abs() <= NEARBY * tolerance
                && dot(&normal, &self.at(pixel).normal) > ALIKE;
            near.then(|| SurfacePlace {
                place: self.out_of_image_axes(&self.at(pixel).place),
                normal: self.out_of_image_axes(&self.at(pixel).normal),
            })
        };
        places.iter().map(found).collect()
    }

    /// Whether a place where nothing was measured faces both places it must be seen from, with nothing before it.
    fn should_be_seen(&self, place: &[f32; 3], normal: &[f32; 3], tolerance: f32) -> bool {
        self.faces(place, normal)
            && self.second_viewpoint.as_ref().is_none_or(|second| {
                let there = second.in_image_axes(&SurfacePlace {
                    place: self.out_of_image_axes(place),
                    normal: self.out_of_image_axes(normal),
                });
                second.faces(&there.place, &there.normal) && !second.hides(&there.place, tolerance)
            })
    }

    fn faces(&self, place: &[f32; 3], normal: &[f32; 3]) -> bool {
        let towards = [-place[0], -place[1], -self.distance - place[2]];
        dot(normal, &towards) > FACING * dot(&towards, &towards).sqrt()
    }

    /// Whether something was measured before a place; not what a surface beside it would be if it went on there.
    fn hides(&self, place: &[f32; 3], tolerance: f32) -> bool {
        self.project(place).is_some_and(|(cell, depth)| {
            let pixel = &self.pixels[cell];
            pixel.seen != Seen::Nothing && {
                let behind = depth - self.distance - self.at(pixel).place[2];
                behind.min(-plane_distance(self.at(pixel), place)) > 2.0 * tolerance
            }
        })
    }

    /// The pixel and the depth of a place in the image's axes.
    fn project(&self, place: &[f32; 3]) -> Option<(usize, f32)> {
        let depth = place[2] + self.distance;
        let center = self.side as f32 / 2.0;
        let [x, y] = [place[0], place[1]].map(|x| x / depth * self.scale + center);
        let inside = |x: f32| x >= 0.0 && x < self.side as f32;
        (depth > 0.0 && inside(x) && inside(y)).then(|| (x as usize * self.side + y as usize, depth))
    }

    fn in_image_axes(&self, point: &SurfacePlace) -> SurfacePlace {
        let rotate = |v: &[f32; 3]| self.axes.map(|axis| dot(&axis, v));
        SurfacePlace { place: rotate(&point.place), normal: rotate(&point.normal) }
    }

    fn out_of_image_axes(&self, v: &[f32; 3]) -> [f32; 3] {
        [0, 1, 2].map(|i| (0..3).map(|k| self.axes[k][i] * v[k]).sum())
    }

    /// The pose, and then into the image's axes.
    pub(crate) fn to_image(&self, pose: &RigidTransform) -> ImagePose {
        let axes = self.axes.map(|axis| Vector3::from(axis.map(f64::from)));
        ImagePose {
            rotation: axes.map(|axis| [0, 1, 2].map(|column| axis.dot(&pose.rotation.column(column)) as f32)),
            translation: axes.map(|axis| axis.dot(&pose.translation) as f32),
        }
    }
}

/// Of each pixel the smallest value in a square of pixels around it, which reaches `reach` pixels to each side.
fn smallest_around(values: &[f32], side: usize, reach: usize) -> Vec<f32> {
    let mut of_rows = values.to_vec();
    let rows = of_rows.chunks_exact_mut(side).zip(values.chunks_exact(side));
    for (smallest, row) in rows {
        for step in 1..=reach.min(side - 1) {
            smallest[step..].iter_mut().zip(row).for_each(|(least, &other)| *least = least.min(other));
            smallest.iter_mut().zip(&row[step..]).for_each(|(least, &other)| *least = least.min(other));
        }
    }
    let mut of_all = of_rows.clone();
    for step in (1..=reach.min(side - 1)).map(|rows| rows * side) {
        of_all[step..].iter_mut().zip(&of_rows).for_each(|(least, &other)| *least = least.min(other));
        of_all.iter_mut().zip(&of_rows[step..]).for_each(|(least, &other)| *least = least.min(other));
    }
    of_all
}

/// Three axes square to each other, the last one along a unit vector.
fn axes_towards(forward: [f64; 3]) -> [[f32; 3]; 3] {
    let forward = Vector3::from(forward);
    let [side, other] = axes_across(&forward);
    [side, other, forward].map(|axis| axis.map(|x| x as f32).into())
}

pub(crate) fn dot(a: &[f32; 3], b: &[f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The signed distance of a point from the tangent plane of another.
fn plane_distance(at: &SurfacePlace, point: &[f32; 3]) -> f32 {
    dot(&at.normal, &[0, 1, 2].map(|i| point[i] - at.place[i]))
}

#[cfg(test)]
mod tests;
