//! What a depth image says of the front of a surface under a pose, and of its outline.

use super::{
    ALIKE, DepthImage, ImagePose, NEARBY, Pixel, Seen, SurfacePlace, dot, plane_distance, smallest_around,
};

/// Pixels from the outline inwards within which something must be confirmed, for the way out to be walked: depth cameras
/// lose what is steep, and let an outline bleed.
const INWARDS: i32 = 4;
/// Pixels from a confirmed place within which a hidden one is next to it.
const BEHIND: i32 = 6;
/// Tolerances of a step in depth from one pixel to the next: that of a surface which is just not too steep to be measured
/// is two pixels.
const STEP: f32 = 3.0;
/// Tolerances of the next point from the tangent plane of the last one, up to which the surface is smooth.
const SMOOTH: f32 = 0.75;
/// Pixels around a surface's picture, so that its outline is within.
const MARGIN: i32 = 2;
/// From a pixel to its neighbours: rows and columns.
const WAYS: [[i32; 2]; 8] = [[0, 1], [1, 1], [1, 0], [1, -1], [0, -1], [-1, -1], [-1, 0], [-1, 1]];

/// How many places of a surface, of those that face the sensor and that the surface itself does not hide, are what; and
/// what is met on the ways out over its outline.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Front {
    /// All of them.
    pub facing: u32,
    /// On the scan's surface, facing alike.
    pub confirmed: u32,
    /// On the scan's surface or just beneath it, but not alike.
    pub mismatched: u32,
    /// Farther behind the scan's surface.
    pub hidden: u32,
    /// Where the sensor saw through.
    pub contradicted: u32,
    /// Where nothing was measured.
    pub missing: u32,
    /// Pixels in which a place is confirmed.
    pub pixels: u32,
    /// Ways out over the outline, whatever is there.
    pub outline: u32,
    /// Those from confirmed places, over which the scan's surface steps back, or nothing was measured.
    pub ends: u32,
    /// Those over which it goes on smoothly.
    pub goes_on: u32,
    /// Ways from a confirmed place to a hidden one near it, on which the scan's surface has no step towards the sensor:
    /// nothing is there that can hide it.
    pub not_covered: u32,
}

/// A surface in the image: its nearest depth and what is confirmed in each pixel of a square.
struct Picture {
    /// Row and column of the square's first pixel in the image.
    first: [i32; 2],
    side: i32,
    /// The smallest in the 3 x 3 pixels around each; infinite off the surface.
    fronts: Vec<f32>,
    told: Vec<Told>,
}

/// What the scan says of the surface in a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Told {
    Nothing,
    Confirmed,
    Hidden,
}

/// A place in the axes of the image.
struct Moved {
    place: [f32; 3],
    normal: [f32; 3],
    depth: f32,
    pixel: [i32; 2],
}

impl Picture {
    fn new(places: &[Moved]) -> Self {
        let end = |k: usize, least: bool| {
            let all = places.iter().map(|place| place.pixel[k]);
            if least { all.min().unwrap_or(0) - MARGIN } else { all.max().unwrap_or(0) + MARGIN }
        };
        let first = [end(0, true), end(1, true)];
        let side = (end(0, false) - first[0]).max(end(1, false) - first[1]) + 1;
        let mut picture = Self { first, side, fronts: Vec::new(), told: Vec::new() };
        let mut depths = vec![f32::INFINITY; (side * side) as usize];
        for place in places {
            if let Some(cell) = picture.cell(place.pixel) {
                depths[cell] = depths[cell].min(place.depth);
            }
        }
        picture.told = vec![Told::Nothing; depths.len()];
        picture.fronts = smallest_around(&depths, side as usize, 1);
        picture
    }

    fn cell(&self, pixel: [i32; 2]) -> Option<usize> {
        let [row, column] = [pixel[0] - self.first[0], pixel[1] - self.first[1]];
        let inside = |x: i32| x >= 0 && x < self.side;
        (inside(row) && inside(column)).then(|| (row * self.side + column) as usize)
    }

    fn has(&self, pixel: [i32; 2]) -> bool {
        self.cell(pixel).is_some_and(|cell| self.fronts[cell] < f32::INFINITY)
    }

    fn told(&self, pixel: [i32; 2]) -> Told {
        self.cell(pixel).map_or(Told::Nothing, |cell| self.told[cell])
    }
}

fn beside(pixel: [i32; 2], way: [i32; 2], steps: i32) -> [i32; 2] {
    [0, 1].map(|k| pixel[k] + steps * way[k])
}

impl DepthImage {
    /// Tells what the scan says about the front of a surface under a pose, whose places are as dense as the pixels.
    ///
    /// `tolerance` is as in [`DepthImage::judge`]; on the ways out `beyond` pixels after the outline are looked at.
    pub(crate) fn front(
        &self,
        pose: &ImagePose,
        places: &[SurfacePlace],
        tolerance: f32,
        beyond: i32,
    ) -> Front {
        let moved = |point: &SurfacePlace| {
            let place = pose.point(&point.place);
            let (cell, depth) = self.project(&place)?;
            let pixel = [(cell / self.side) as i32, (cell % self.side) as i32];
            Some(Moved { place, normal: pose.vector(&point.normal), depth, pixel })
        };
        let places: Vec<Moved> = places.iter().filter_map(moved).collect();
        let mut front = Front::default();
        let mut picture = Picture::new(&places);
        for place in &places {
            self.add_place(place, tolerance, &mut picture, &mut front);
        }
        for row in 0..picture.side {
            for column in 0..picture.side {
                let pixel = [row + picture.first[0], column + picture.first[1]];
                if picture.has(pixel) {
                    for way in WAYS {
                        self.add_way_behind(pixel, way, &picture, tolerance, &mut front);
                        self.add_way(pixel, way, &picture, tolerance, beyond, &mut front);
                    }
                }
            }
        }
        front
    }

    fn add_place(&self, place: &Moved, tolerance: f32, picture: &mut Picture, front: &mut Front) {
        let Some(cell) = picture.cell(place.pixel) else { return };
        if place.depth > picture.fronts[cell] + 2.0 * tolerance || !self.faces(&place.place, &place.normal) {
            return;
        }
        let Some(pixel) = self.pixel(place.pixel) else { return };
        front.facing += 1;
        match pixel.seen {
            Seen::Between => {}
            Seen::Nothing => front.missing += 1,
            seen => {
                let distance = plane_distance(self.at(pixel), &place.place).abs();
                let is_alike = dot(&place.normal, &self.at(pixel).normal) > ALIKE;
                if seen == Seen::Own && distance <= tolerance && is_alike {
                    front.confirmed += 1;
                    front.pixels += u32::from(picture.told[cell] != Told::Confirmed);
                    picture.told[cell] = Told::Confirmed;
                } else if place.depth < pixel.front - 2.0 * tolerance {
                    front.contradicted += 1;
                } else if distance <= NEARBY * tolerance {
                    front.mismatched += 1;
                } else {
                    front.hidden += 1;
                    if picture.told[cell] == Told::Nothing {
                        picture.told[cell] = Told::Hidden;
                    }
                }
            }
        }
    }

    /// Walks from a pixel of the surface outwards, where its outline is beside it.
    fn add_way(
        &self,
        pixel: [i32; 2],
        way: [i32; 2],
        picture: &Picture,
        tolerance: f32,
        beyond: i32,
        front: &mut Front,
    ) {
        if (1..=beyond).any(|steps| picture.has(beside(pixel, way, steps))) {
            return;
        }
        front.outline += 1;
        let inwards =
            (0..=INWARDS).find(|&steps| picture.told(beside(pixel, way, -steps)) == Told::Confirmed);
        let Some(start) = inwards.map(|steps| beside(pixel, way, -steps)) else { return };
        let Some(mut last) = self.pixel(start).map(|pixel| *self.at(pixel)) else { return };
        let (mut is_smooth, mut is_lost) = (true, false);
        for steps in 1..=inwards.unwrap_or(0) + beyond {
            let Some(pixel) = self.pixel(beside(start, way, steps)) else { return };
            is_lost = pixel.seen == Seen::Nothing;
            is_smooth &= matches!(pixel.seen, Seen::Own | Seen::Between);
            if matches!(pixel.seen, Seen::Nothing | Seen::Between) {
                continue;
            }
            let next = *self.at(pixel);
            let step = next.place[2] - last.place[2];
            if step.abs() > STEP * tolerance {
                // Something nearer hides where the surface ends.
                front.ends += u32::from(step > 0.0);
                return;
            }
            is_smooth &= plane_distance(&last, &next.place).abs() <= SMOOTH * tolerance
                && dot(&last.normal, &next.normal) > ALIKE;
            last = next;
        }
        // Where nothing was measured beyond the outline, the surface does not go on.
        front.ends += u32::from(is_lost);
        front.goes_on += u32::from(is_smooth);
    }

    /// Looks from a confirmed pixel for a hidden one next to it, and for what hides it.
    fn add_way_behind(
        &self,
        pixel: [i32; 2],
        way: [i32; 2],
        picture: &Picture,
        tolerance: f32,
        front: &mut Front,
    ) {
        let told = |steps: i32| picture.told(beside(pixel, way, steps));
        if told(0) != Told::Confirmed || told(1) == Told::Confirmed {
            return;
        }
        let Some(hidden) = (1..=BEHIND).find(|&steps| told(steps) != Told::Nothing) else { return };
        if told(hidden) != Told::Hidden {
            return;
        }
        let seen =
            |steps: i32| self.pixel(beside(pixel, way, steps)).filter(|pixel| pixel.seen != Seen::Nothing);
        let depths: Vec<f32> = (0..=hidden).filter_map(seen).map(|pixel| self.at(pixel).place[2]).collect();
        let is_covered = depths.windows(2).any(|pair| pair[1] - pair[0] < -STEP * tolerance);
        front.not_covered += u32::from(!is_covered);
    }

    fn pixel(&self, at: [i32; 2]) -> Option<&Pixel> {
        let side = self.side as i32;
        let inside = |x: i32| x >= 0 && x < side;
        (inside(at[0]) && inside(at[1])).then(|| &self.pixels[(at[0] * side + at[1]) as usize])
    }
}
