//! The surfaces, and how far points are from them.

use super::SurfaceKind;
use crate::geometry::axes_across;
use nalgebra::Vector3;

/// A point or a direction.
pub(crate) type Vector = Vector3<f64>;

/// Most parameters that a surface has.
pub(super) const MOST_PARAMETERS: usize = 7;

/// A surface without a boundary, as [`crate::fit_primitive`] gives it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Primitive {
    pub(crate) kind: SurfaceKind,
    pub(crate) point: Vector,
    pub(crate) axis: Vector,
    pub(crate) radius: f64,
    pub(crate) major_radius: f64,
    pub(crate) half_angle: f64,
}

/// A surface and two directions across its axis, in which its parameters are counted.
///
/// In this order: a plane's offset, and the tilts of its normal; a sphere's centre and radius; of all surfaces of
/// revolution the shifts of the axis, its tilts, and then the radius (cylinder), the radius and the half angle
/// (cone), the shift along the axis, the major radius and the tube's radius (torus), the shift along the axis and the
/// radius (circle); a line has shifts and tilts only.
pub(crate) struct Chart {
    pub primitive: Primitive,
    pub across: [Vector; 2],
    sine: f64,
    cosine: f64,
}

impl Primitive {
    /// What it is.
    pub fn kind(&self) -> SurfaceKind {
        self.kind
    }

    /// On the plane, the axis or the line, next to the mean of the points; the centre of a sphere, torus or circle.
    pub fn point(&self) -> [f64; 3] {
        self.point.into()
    }

    /// Unit: a plane's normal, the axis of all others; with a positive z (else y, else x), but along a cone its radius
    /// grows. Not a number for a sphere.
    pub fn axis(&self) -> [f64; 3] {
        if self.kind == SurfaceKind::Sphere { [f64::NAN; 3] } else { self.axis.into() }
    }

    /// Of a sphere, cylinder or circle; of a cone at [`Self::point`]; of a torus's tube; not a number for a plane or a
    /// line.
    pub fn radius(&self) -> f64 {
        if [SurfaceKind::Plane, SurfaceKind::Line].contains(&self.kind) { f64::NAN } else { self.radius }
    }

    /// Of a torus, from the axis to the middle of the tube; not a number for others.
    pub fn major_radius(&self) -> f64 {
        if self.kind == SurfaceKind::Torus { self.major_radius } else { f64::NAN }
    }

    /// Half the angle at a cone's apex, in radians; not a number for others.
    pub fn half_angle(&self) -> f64 {
        if self.kind == SurfaceKind::Cone { self.half_angle } else { f64::NAN }
    }

    /// Signed distances of points: positive outside, or where a plane's normal points; from a curve without a sign.
    pub fn distances(&self, points: &[[f64; 3]]) -> Vec<f64> {
        let chart = self.chart();
        points.iter().map(|&point| chart.distance(&Vector::from(point))).collect()
    }

    /// The same surface, held next to a place.
    pub(crate) fn beside(&self, place: &Vector) -> Self {
        let from = place - self.point;
        let height = from.dot(&self.axis);
        match self.kind {
            SurfaceKind::Plane => Self { point: place - height * self.axis, ..*self },
            SurfaceKind::Cylinder | SurfaceKind::Cone | SurfaceKind::Line => Self {
                point: self.point + height * self.axis,
                radius: self.radius + height * self.half_angle.tan(),
                ..*self
            },
            SurfaceKind::Sphere | SurfaceKind::Torus | SurfaceKind::Circle => *self,
        }
    }

    /// The same surface; its axis has a positive z (else y, else x) where its sign means nothing.
    pub(crate) fn upward(&self) -> Self {
        let up = self.kind == SurfaceKind::Cone || [self.axis.z, self.axis.y, self.axis.x] > [0.0; 3];
        Self { axis: if up { self.axis } else { -self.axis }, ..*self }
    }

    /// The surface elsewhere.
    pub(super) fn shifted(&self, by: &Vector) -> Self {
        Self { point: self.point + by, ..*self }
    }

    /// The surface in another unit of length.
    pub(super) fn scaled(&self, by: f64) -> Self {
        let (point, radius, major_radius) = (by * self.point, by * self.radius, by * self.major_radius);
        Self { point, radius, major_radius, ..*self }
    }

    pub(crate) fn chart(&self) -> Chart {
        let (sine, cosine) = self.half_angle.sin_cos();
        Chart { primitive: *self, across: axes_across(&self.axis), sine, cosine }
    }

    /// Whether it is of its kind at all, for points that extend so far, and not `flat` times larger than these.
    pub(super) fn is_valid(&self, extent: f64, flat: f64) -> bool {
        let finite = self.point.iter().chain(self.axis.iter()).all(|c| c.is_finite());
        let radius = self.radius > 1e-6 * extent && self.radius < flat * extent;
        finite
            && match self.kind {
                SurfaceKind::Plane | SurfaceKind::Line => true,
                SurfaceKind::Sphere | SurfaceKind::Cylinder | SurfaceKind::Circle => radius,
                SurfaceKind::Cone => {
                    self.radius.abs() < flat * extent && (0.01..1.55).contains(&self.half_angle)
                }
                SurfaceKind::Torus => {
                    radius && self.major_radius > self.radius && self.major_radius < flat * extent
                }
            }
    }
}

impl Chart {
    /// Signed distance of a point.
    pub fn distance(&self, point: &Vector) -> f64 {
        let p = &self.primitive;
        let from = point - p.point;
        match p.kind {
            SurfaceKind::Plane => from.dot(&p.axis),
            SurfaceKind::Sphere => from.norm() - p.radius,
            _ => {
                let height = from.dot(&p.axis);
                let away = (from - height * p.axis).norm();
                match p.kind {
                    SurfaceKind::Line => away,
                    SurfaceKind::Circle => length(away - p.radius, height),
                    SurfaceKind::Cylinder => away - p.radius,
                    SurfaceKind::Cone => (away - p.radius) * self.cosine - height * self.sine,
                    _ => length(away - p.major_radius, height) - p.radius,
                }
            }
        }
    }

    /// The point of a circle or line that is nearest to a point.
    pub fn foot_on_curve(&self, point: &Vector) -> Vector {
        let p = &self.primitive;
        let from = point - p.point;
        let along = from.dot(&p.axis) * p.axis;
        if p.kind == SurfaceKind::Line {
            return p.point + along;
        }
        let beside = from - along;
        p.point + p.radius / beside.norm().max(f64::MIN_POSITIVE) * beside
    }

    /// The surface's normal next to a point.
    pub fn normal(&self, point: &Vector) -> Vector {
        let p = &self.primitive;
        let from = point - p.point;
        if p.kind == SurfaceKind::Plane {
            return p.axis;
        }
        if p.kind == SurfaceKind::Sphere {
            return from.normalize();
        }
        let height = from.dot(&p.axis);
        let outward = (from - height * p.axis).normalize();
        match p.kind {
            SurfaceKind::Cylinder | SurfaceKind::Line => outward,
            SurfaceKind::Circle => (from - p.radius * outward).normalize(),
            SurfaceKind::Cone => self.cosine * outward - self.sine * p.axis,
            _ => (from - p.major_radius * outward).normalize(),
        }
    }

    /// The components of a point's distance with their derivatives by the parameters: of a surface the first alone.
    pub fn components(&self, point: &Vector) -> [(f64, [f64; MOST_PARAMETERS]); 2] {
        let p = &self.primitive;
        if p.kind.components() == 1 {
            return [self.distance_and_derivatives(point), (0.0, [0.0; MOST_PARAMETERS])];
        }
        let from = point - p.point;
        let height = from.dot(&p.axis);
        let along = self.across.map(|direction| from.dot(&direction));
        let mut by = [[0.0; MOST_PARAMETERS]; 2];
        if p.kind == SurfaceKind::Line {
            for i in 0..2 {
                (by[i][i], by[i][2 + i]) = (-1.0, -height);
            }
            return [(along[0], by[0]), (along[1], by[1])];
        }
        let away = length(along[0], along[1]);
        for i in 0..2 {
            let outward = along[i] / away.max(f64::MIN_POSITIVE);
            (by[0][i], by[0][2 + i], by[1][2 + i]) = (-outward, -height * outward, along[i]);
        }
        (by[1][4], by[0][5]) = (-1.0, -1.0);
        [(away - p.radius, by[0]), (height, by[1])]
    }

    /// Signed distance of a point from a surface, and its derivatives by the parameters.
    pub fn distance_and_derivatives(&self, point: &Vector) -> (f64, [f64; MOST_PARAMETERS]) {
        let p = &self.primitive;
        let from = point - p.point;
        let along = self.across.map(|direction| from.dot(&direction));
        let mut by = [0.0; MOST_PARAMETERS];
        if p.kind == SurfaceKind::Plane {
            by[..3].copy_from_slice(&[-1.0, along[0], along[1]]);
            return (from.dot(&p.axis), by);
        }
        if p.kind == SurfaceKind::Sphere {
            let length = from.norm();
            let direction = from / length.max(f64::MIN_POSITIVE);
            by[..4].copy_from_slice(&[-direction.x, -direction.y, -direction.z, -1.0]);
            return (length - p.radius, by);
        }
        let height = from.dot(&p.axis);
        let away = length(along[0], along[1]);
        let outward = along.map(|a| a / away.max(f64::MIN_POSITIVE));
        // The distance, and its derivatives by the distance from the axis and by the height.
        let (distance, by_away, by_height) = match p.kind {
            SurfaceKind::Cylinder => (away - p.radius, 1.0, 0.0),
            SurfaceKind::Cone => {
                ((away - p.radius) * self.cosine - height * self.sine, self.cosine, -self.sine)
            }
            _ => {
                let (across, up) = (away - p.major_radius, height);
                let length = length(across, up).max(f64::MIN_POSITIVE);
                (length - p.radius, across / length, up / length)
            }
        };
        for i in 0..2 {
            by[i] = -by_away * outward[i];
            by[2 + i] = by_height * along[i] - by_away * height * outward[i];
        }
        match p.kind {
            SurfaceKind::Cylinder => by[4] = -1.0,
            SurfaceKind::Cone => {
                by[4] = -self.cosine;
                by[5] = -(away - p.radius) * self.sine - height * self.cosine;
            }
            _ => (by[4], by[5], by[6]) = (-by_height, -by_away, -1.0),
        }
        (distance, by)
    }

    /// The surface with its parameters changed.
    pub fn moved(&self, step: &[f64]) -> Primitive {
        let mut p = self.primitive;
        let [first, second] = self.across;
        match p.kind {
            SurfaceKind::Plane => {
                p.point += step[0] * p.axis;
                p.axis = (p.axis + step[1] * first + step[2] * second).normalize();
            }
            SurfaceKind::Sphere => {
                p.point += Vector::new(step[0], step[1], step[2]);
                p.radius += step[3];
            }
            kind => {
                p.point += step[0] * first + step[1] * second;
                if kind == SurfaceKind::Torus {
                    p.point += step[4] * p.axis;
                    p.major_radius += step[5];
                    p.radius += step[6];
                } else if kind == SurfaceKind::Circle {
                    p.point += step[4] * p.axis;
                    p.radius += step[5];
                } else if kind != SurfaceKind::Line {
                    p.radius += step[4];
                    p.half_angle += step.get(5).copied().unwrap_or(0.0);
                }
                p.axis = (p.axis + step[2] * first + step[3] * second).normalize();
            }
        }
        p
    }
}

/// How far points are spread: the diagonal of their box.
pub(crate) fn extent(points: &[Vector]) -> f64 {
    let far = Vector::repeat(f64::INFINITY);
    let (low, high) = points.iter().fold((far, -far), |(low, high), p| (low.inf(p), high.sup(p)));
    (high - low).norm()
}

/// By a square root: these lengths are far from where a square overflows, and `hypot` takes ten times as long.
fn length(x: f64, y: f64) -> f64 {
    (x * x + y * y).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn examples() -> [Primitive; 7] {
        let axis = Vector::new(0.36, -0.48, 0.8);
        let point = Vector::new(0.3, 0.2, -0.5);
        let [plane, sphere, cylinder, cone, torus] = SurfaceKind::ALL;
        let [circle, line] = SurfaceKind::CURVES;
        [plane, sphere, cylinder, cone, torus, circle, line].map(|kind| Primitive {
            kind,
            point,
            axis,
            radius: 0.4,
            major_radius: if kind == SurfaceKind::Torus { 1.3 } else { 0.0 },
            half_angle: if kind == SurfaceKind::Cone { 0.5 } else { 0.0 },
        })
    }

    #[test]
    fn derivatives_are_those_of_small_changes() {
        for primitive in examples() {
            let chart = primitive.chart();
            for place in [[0.9, 0.1, 0.2], [-0.7, 0.8, 0.4], [0.2, -1.1, 0.3]].map(Vector::from) {
                let components = chart.components(&place);
                let square: f64 = components.iter().map(|(component, _)| component * component).sum();
                assert!((square.sqrt() - chart.distance(&place).abs()).abs() < 1e-14);
                for parameter in 0..primitive.kind.parameters() {
                    // In the axes of the chart, which those of the moved surface are but for its tilt.
                    let changed = |by: f64| {
                        let mut step = [0.0; MOST_PARAMETERS];
                        step[parameter] = by;
                        chart.moved(&step[..primitive.kind.parameters()]).chart().distance(&place).powi(2)
                    };
                    let slope = (changed(1e-5) - changed(-1e-5)) / 2e-5;
                    let expected: f64 = components.iter().map(|(c, by)| 2.0 * c * by[parameter]).sum();
                    assert!(
                        (slope - expected).abs() < 1e-8,
                        "{:?} {parameter}: {slope} {expected}",
                        primitive.kind
                    );
                }
            }
        }
    }

    #[test]
    fn distances_are_those_of_formulas() {
        let [_, _, cylinder, cone, torus, circle, line] = examples().map(|p| p.chart());
        // Straight out from the axis, at the point's height.
        let out = Vector::new(0.8, 0.6, 0.0);
        let at = |away: f64| Vector::new(0.3, 0.2, -0.5) + away * out;
        assert!((cylinder.distance(&at(1.0)) - 0.6).abs() < 1e-14);
        assert!((cone.distance(&at(1.0)) - 0.6 * 0.5_f64.cos()).abs() < 1e-14);
        assert!((torus.distance(&at(1.0)) - (0.3 - 0.4)).abs() < 1e-14);
        let above = at(0.8) - 0.3 * Vector::new(0.36, -0.48, 0.8);
        assert!((circle.distance(&above) - 0.5).abs() < 1e-14);
        assert!((line.distance(&above) - 0.8).abs() < 1e-14);
    }
}
