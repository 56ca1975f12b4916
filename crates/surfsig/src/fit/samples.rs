//! Points on surfaces whose curvature is known, for the tests of all fits.

use nalgebra::{Rotation3, Vector3};

pub(super) type Point = [f64; 3];

/// Reproducible numbers: uniform ones in [0, 1), and normal ones.
pub(crate) struct Draws(pub u64);

impl Draws {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        for (shift, factor) in [(30, 0xbf58_476d_1ce4_e5b9_u64), (27, 0x94d0_49bb_1331_11eb)] {
            x = (x ^ (x >> shift)).wrapping_mul(factor);
        }
        ((x ^ (x >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

/// A surface through the origin, where its normal is +z.
#[derive(Debug, Clone, Copy)]
pub(super) enum Shape {
    Plane,
    Sphere(f64),
    /// The axis runs along y.
    Cylinder(f64),
    /// Half its opening angle, and the distance of the origin from the apex along the surface.
    Cone(f64, f64),
    /// Semi-axes along x, y, z.
    Ellipsoid([f64; 3]),
}

impl Shape {
    fn draw(self, draws: &mut Draws) -> Point {
        match self {
            Self::Plane => [draws.between(-1.0, 1.0), draws.between(-1.0, 1.0), 0.0],
            Self::Sphere(r) => {
                let z = draws.between(-(2.0 * r).min(0.5 / r), 0.0);
                let (sine, cosine) = draws.between(0.0, std::f64::consts::TAU).sin_cos();
                let rho = (-z * (z + 2.0 * r)).max(0.0).sqrt();
                [rho * cosine, rho * sine, z]
            }
            Self::Cylinder(r) => {
                let angle = draws.between(-1.0, 1.0) * 2.0 * (0.5 / r).min(1.0).asin();
                [r * angle.sin(), draws.between(-1.0, 1.0), r * (angle.cos() - 1.0)]
            }
            Self::Cone(half, distance) => {
                let along = draws.between((distance - 1.0).max(0.0), distance + 1.0);
                let (sine, cosine) = draws.between(0.0, std::f64::consts::TAU).sin_cos();
                // About an axis that leans by `half` from y, so that the generator of the origin lies along y.
                let (radial, axial) = (along * half.sin(), along * half.cos());
                let [x, y, z] = [radial * sine, axial, radial * cosine];
                let (s, c) = half.sin_cos();
                [x, c * y + s * z - distance, c * z - s * y]
            }
            Self::Ellipsoid([a, b, c]) => {
                let (sine, cosine) = draws.between(0.0, std::f64::consts::TAU).sin_cos();
                let height = draws.between(-1.0, 1.0);
                let rho = (1.0 - height * height).sqrt();
                [a * rho * cosine, b * rho * sine, c * (height - 1.0)]
            }
        }
    }

    /// k1 >= k2 at the origin.
    pub fn curvatures(self) -> [f64; 2] {
        match self {
            Self::Plane => [0.0; 2],
            Self::Sphere(r) => [1.0 / r; 2],
            Self::Cylinder(r) => [1.0 / r, 0.0],
            Self::Cone(half, distance) => [1.0 / (distance * half.tan()), 0.0],
            Self::Ellipsoid([a, b, c]) => {
                let k = [c / (a * a), c / (b * b)];
                [k[0].max(k[1]), k[0].min(k[1])]
            }
        }
    }

    /// Points within 1 of the origin, only those with x above `from`, with noise in all directions.
    pub fn points(self, count: usize, from: f64, noise: f64, draws: &mut Draws) -> Vec<Point> {
        let mut points = Vec::with_capacity(count);
        while points.len() < count {
            let p = self.draw(draws);
            if p.iter().map(|c| c * c).sum::<f64>() <= 1.0 && p[0] >= from {
                points.push(p.map(|c| c + noise * draws.normal()));
            }
        }
        points
    }
}

pub(super) fn turned(points: &[Point], rotation: &Rotation3<f64>) -> Vec<Point> {
    points.iter().map(|p| (rotation * Vector3::from(*p)).into()).collect()
}
