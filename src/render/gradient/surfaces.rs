//! What is known of the surfaces in the picture before it is rendered: the place that each pixel's centre shows, by which pairs of
//! neighbours are told apart (shaders/lib/gradient.glsl).

use bytemuck::zeroed_vec;
use glam::Vec3;
use rayon::prelude::*;

use crate::render::engine::Engine;
use crate::render::error::RenderError;
use crate::render::first_hit::{CameraRay, FirstHitTracer};
use crate::render::kernel::layout::FirstHit;
use crate::render::kernel::layout::first_hit::RECONNECTABLE;

/// Classes of pairs of pixels, see [`DiffusePlaces::class`].
pub(crate) const CLASSES: usize = 8;

/// A pixel's neighbour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Side {
    Right,
    Down,
}

/// The places of diffuse surfaces that pixels show, in render space, row by row; 0 where there is none.
#[derive(Debug, Clone, Default)]
pub(crate) struct DiffusePlaces {
    pub width: usize,
    all: Vec<Vec3>,
    /// How much the ways from a pixel's place to those of its neighbours differ, along a row and along a column: see [`curvature`]. NaN where
    /// one of the three is not there.
    bends: Vec<[f32; 2]>,
}

impl DiffusePlaces {
    /// Of pixels in rows of such a width.
    pub fn new(width: usize, all: Vec<Vec3>) -> Self {
        let rows: Vec<_> = all.chunks_exact(width).collect();
        let mut bends = zeroed_vec::<[f32; 2]>(all.len());
        bends.par_chunks_mut(width).enumerate().for_each(|(y, bends)| {
            let above = y.checked_sub(1).map(|y| rows[y]);
            let (row, below) = (rows[y], rows.get(y + 1));
            for x in 0..width {
                let across = (x > 0 && x + 1 < width).then(|| [row[x - 1], row[x], row[x + 1]]);
                let down = above.zip(below).map(|(above, below)| [above[x], row[x], below[x]]);
                bends[x] = [across, down].map(|places| places.map_or(f32::NAN, curvature));
            }
        });
        Self { width, all, bends }
    }

    /// A pixel's neighbour on a side.
    fn neighbour(&self, pixel: usize, side: Side) -> Option<usize> {
        match side {
            Side::Right => Some(pixel + 1).filter(|q| !q.is_multiple_of(self.width)),
            Side::Down => Some(pixel + self.width).filter(|q| *q < self.all.len()),
        }
    }

    /// How differently a pixel and its neighbour on a side see the light of other surfaces, by what may be told from places:
    /// the classes of pairs, from alike to different; `None` if one of them shows no diffuse surface.
    pub fn class(&self, pixel: usize, side: Side) -> Option<usize> {
        self.class_of_pair(pixel, self.neighbour(pixel, side)?, side)
    }

    /// The same, the neighbour being known.
    pub fn class_of_pair(&self, pixel: usize, neighbour: usize, side: Side) -> Option<usize> {
        if self.all[pixel] == Vec3::ZERO || self.all[neighbour] == Vec3::ZERO {
            return None;
        }
        // On a plane, what pixels in a row show lies on a line.
        let [here, there] =
            [pixel, neighbour].map(|p| Some(self.bends[p][side as usize]).filter(|curvature| !curvature.is_nan()));
        let curvature = match [here, there] {
            [Some(one), Some(other)] => one + other,
            [Some(one), None] | [None, Some(one)] => 2.0 * one,
            [None, None] => f32::MAX,
        };
        // A class is a factor of 8: three steps of the exponent of a number from 1 on.
        let exponent = ((curvature.max(1e-6) * 1e6).max(1.0).to_bits() >> 23) - 127;
        Some((exponent as usize / 3).min(CLASSES - 1))
    }
}

/// The square of the distance between the directions from one place to the next, and from there to the one after; NaN if one of the
/// three is not there.
fn curvature(places: [Vec3; 3]) -> f32 {
    if places.contains(&Vec3::ZERO) {
        return f32::NAN;
    }
    let [before, here, after] = places;
    let (a, b) = (after - here, here - before);
    let cos = a.dot(b) / (a.length() * b.length());
    if cos.is_finite() { 2.0 - 2.0 * cos } else { 4.0 }
}

/// Before a rendering: finds the surfaces at the pixels' centres, also those that are seen in mirrors.
///
/// # Errors
/// The device fails.
pub(crate) fn find_diffuse_places(
    engine: &mut Engine,
    first_hits: &mut FirstHitTracer,
) -> Result<DiffusePlaces, RenderError> {
    let [width, height] = engine.size().map(|size| size as usize);
    let mut all: Vec<Vec3> = zeroed_vec(width * height);
    let whole = engine.whole_film();
    let put = |place: &mut Vec3, hit: &FirstHit| {
        if hit.is(RECONNECTABLE) {
            *place = Vec3::from_array(hit.position);
        }
    };
    engine.look(|_| (), |engine| first_hits.trace(engine, &whole, (CameraRay::Center, true), &mut all, put))?;
    Ok(DiffusePlaces::new(width, all))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn classes_go_from_alike_to_different() {
        let class = |heights: [f32; 4]| {
            let place = |(x, y): (usize, &f32)| Vec3::new(x as f32 + 1.0, *y, -5.0);
            let all: Vec<_> = heights.iter().enumerate().map(place).collect();
            let (row, column) = (DiffusePlaces::new(4, all.clone()), DiffusePlaces::new(1, all));
            assert_eq!(row.class(1, Side::Right), column.class(1, Side::Down));
            row.class(1, Side::Right)
        };
        assert_eq!(class([3.0; 4]), Some(0));
        assert_eq!(class([0.0, 1.0, 2.0, 3.0]), Some(0));
        let bent = [[0.0, 0.0, 0.0, 0.01], [0.0, 0.0, 0.0, 0.1], [0.0, 0.0, 1.0, 1.0], [0.0, 0.0, 9.0, 8.0]].map(class);
        assert!(bent.is_sorted() && bent[0] > Some(0) && bent[3] == Some(CLASSES - 1), "{bent:?}");
    }

    #[test]
    fn pairs_need_two_places() {
        let all = vec![Vec3::X, Vec3::new(1.0, 0.0, 1.0), Vec3::ZERO, Vec3::Z];
        let places = DiffusePlaces::new(2, all);
        // Nothing tells of a plane.
        assert_eq!(places.class(0, Side::Right), Some(CLASSES - 1));
        assert_eq!((places.class(0, Side::Down), places.class(2, Side::Right)), (None, None));
        assert_eq!((places.class(1, Side::Right), places.class(3, Side::Down)), (None, None));
    }
}
