//! Finds the pixels that need more samples for what the camera sees (shaders/lib/sample_map.glsl): the edges of emitters, and, where light
//! is traced from emitters to take the noise of caustics elsewhere, mirrors and glass.

use bytemuck::{Zeroable, zeroed_vec};
use rayon::prelude::*;

use crate::render::engine::Engine;
use crate::render::error::RenderError;
use crate::render::film::tiling::{SIDE, TILE, pixel_of_slot, pixels_in, slot_count, tile_of_pixel, tiles_around};
use crate::render::first_hit::{CameraRay, FirstHitTracer};
use crate::render::kernel::features::Features;
use crate::render::kernel::layout::{FilmSlot, Push, first_hit};
use crate::render::plan::dispatch::{Span, Work};
use crate::render::sampling::multiplier::Multiplier;
use crate::render::sampling::sample_map_decision::greatest_multiplier;
use crate::render::space::view::Rectangle;

/// Samples of a pixel from which edges are found.
const FIRST_SAMPLES: u32 = 4;
/// What the seed is changed by (XOR) for these, so that what is found does not depend on the image's random numbers: a pixel whose number
/// of samples its own ones decided would be biased.
const SEED: u32 = 0x9216_d5d9;

/// Multipliers where a mirror, and where glass is seen. Variance × time with 2 and with 4 paths through glass, against 1: .57 and .41 (a
/// mesh of glass), .73 and .56 (an icosphere of glass), .72 and .58 (balls), lavapipe 25.0.7; 8 change little. By mirrors 2 take that to .97
/// and .89 where there is glass as well; where there is none, to .94 at best.
const BY_MIRRORS: Multiplier = Multiplier::TWO;
const THROUGH_GLASS: Multiplier = Multiplier::FOUR;

/// Further samples of pixels at edges, the others of their groups left out, at most: over those that are asked for of the whole image.
const MOST_AT_EDGES: f64 = 1.0;
/// The rest is estimated from one sample of each pixel of every so many tiles, or of fewer if these are more than enough.
const REST_STEP: usize = 15;
const REST_TILES: usize = 128;

/// Tiles from one where emitters may be seen to the next that are looked at with them rather than left out: a dispatch each takes
/// longer.
const SHORT_GAP: usize = 8;

/// The tiles of an image that these pixels are in, in increasing order, and those in short gaps between them.
fn tiles_of(pixels: &[Rectangle], [width, height]: [u32; 2]) -> Vec<usize> {
    let [columns, rows] = [width, height].map(|size| size.div_ceil(SIDE) as usize);
    // By how many rectangles cover a tile more than what is on its left and above: a sum over those tells how many do.
    let mut more = vec![0i32; (columns + 1) * (rows + 1)];
    for [x, y] in pixels.iter().filter(|[x, y]| !x.is_empty() && !y.is_empty()) {
        let [left, top] = [x.start, y.start].map(|first| (first / SIDE) as usize);
        let [right, bottom] = [x.end, y.end].map(|end| end.div_ceil(SIDE) as usize);
        for (column, row, count) in [(left, top, 1), (right, top, -1), (left, bottom, -1), (right, bottom, 1)] {
            more[row * (columns + 1) + column] += count;
        }
    }
    let mut above = vec![0; columns];
    let mut tiles = Vec::new();
    for row in 0..rows {
        let mut sum = 0;
        for column in 0..columns {
            sum += more[row * (columns + 1) + column];
            above[column] += sum;
            if above[column] > 0 {
                tiles.push(tile_of_pixel(column as u32 * SIDE, row as u32 * SIDE, width) as usize);
            }
        }
    }
    tiles.sort_unstable();
    let up_to_next = |pair: &[usize]| pair[0]..if pair[1] - pair[0] <= SHORT_GAP { pair[1] } else { pair[0] + 1 };
    tiles.windows(2).flat_map(up_to_next).chain(tiles.last().copied()).collect()
}

/// Of so many tiles of an image every how many-th tells of the rest: an odd number, so that they are in all columns of a block.
fn rest_step(tiles: usize) -> usize {
    (tiles / REST_TILES).max(REST_STEP) | 1
}

/// Whether to look at so many tiles of an image before so many samples of each pixel. That takes about as long as half a sample of
/// these tiles: not before a single sample if they are more than half of the image.
fn pays(tiles: usize, size: [u32; 2], samples: u32) -> bool {
    let all: usize = size.iter().map(|size| size.div_ceil(SIDE) as usize).product();
    samples > 1 || 2 * tiles <= all
}

/// What a pixel sees, directly or in mirrors.
#[derive(Debug, Clone, Copy, Zeroable, Default)]
struct Seen {
    /// Brightness of emitters, over all rays.
    emitted: f64,
    /// Some ray meets a mirror, or glass.
    mirror: bool,
    glass: bool,
}

/// Whether glass and mirrors that the camera sees get more samples, in a scene that needs these features and with so many targets of
/// light that is traced from emitters.
pub(crate) fn looks_for_glass(needed: &Features, casters: u32) -> bool {
    casters > 0 && needed.dielectric
}

/// Where pixels are looked for.
pub(crate) struct EdgeSearch<'a> {
    /// The pixels that may show the edges of emitters.
    pub emitter_bounds: &'a [Rectangle],
    /// Whether glass and mirrors that the camera sees get more samples.
    pub glass: bool,
    /// Samples of the rendering, per pixel.
    pub samples: u32,
    /// Tests only: with the random numbers of the image.
    pub own_seed: bool,
}

/// The least multiplier of each pixel, row by row, for what it sees; `None` if that was not looked for. The film is left
/// to the caller.
///
/// # Errors
/// The device fails.
pub(crate) fn look_for_edges(
    engine: &mut Engine,
    first_hits: &mut FirstHitTracer,
    search: &EdgeSearch<'_>,
) -> Result<Option<Vec<Multiplier>>, RenderError> {
    let size @ [width, height] = engine.size();
    let tiles = if search.glass {
        (0..slot_count(width, height) as usize / TILE).collect()
    } else {
        tiles_of(search.emitter_bounds, size)
    };
    if tiles.is_empty() || !(search.glass || pays(tiles.len(), size, search.samples)) {
        return Ok(None);
    }
    let reseed = |push: &mut Push| push.seed ^= if search.own_seed { 0 } else { SEED };
    engine.look(reseed, |engine| multipliers_of_seen(engine, first_hits, search, &tiles)).map(Some)
}

/// What these tiles may show decides.
fn multipliers_of_seen(
    engine: &mut Engine,
    first_hits: &mut FirstHitTracer,
    search: &EdgeSearch<'_>,
    tiles: &[usize],
) -> Result<Vec<Multiplier>, RenderError> {
    let [width, height] = engine.size();
    let spans = engine.spans_of(tiles.iter().copied());
    // Of both only what is written takes memory.
    let pixels = width as usize * height as usize;
    let (mut seen, mut multipliers) = (zeroed_vec::<Seen>(pixels), zeroed_vec::<Multiplier>(pixels));
    for sample in 0..FIRST_SAMPLES {
        first_hits.trace(engine, &spans, (CameraRay::OfSample(sample), true), &mut seen, |seen, hit| {
            seen.emitted += f64::from(hit.emitted);
            seen.mirror |= hit.is(first_hit::BY_MIRRORS);
            seen.glass |= hit.is(first_hit::GLASS);
        })?;
    }
    if search.glass {
        multipliers.par_iter_mut().zip(&seen).for_each(|(multiplier, seen)| {
            *multiplier = match (seen.mirror, seen.glass) {
                (_, true) => THROUGH_GLASS,
                (true, false) => BY_MIRRORS,
                (false, false) => Multiplier::ONE,
            };
        });
    }
    let edges = edges(&seen, width as usize, &pixels_around(tiles, width, height));
    if !edges.is_empty() {
        let rest = mean_of_rest(engine, &seen)?;
        let at_edges: Vec<_> =
            edges.iter().map(|(pixel, contrast)| (*pixel, multiplier_at_edge(contrast / rest))).collect();
        let budget = MOST_AT_EDGES * multipliers.len() as f64;
        let greatest = greatest_within(&at_edges, greatest_multiplier(search.samples), budget);
        for (pixel, multiplier) in at_edges {
            multipliers[pixel] = multiplier.min(greatest).max(multipliers[pixel]);
        }
    }
    Ok(multipliers)
}

/// The mean brightness of the image where no emitters are `seen`.
fn mean_of_rest(engine: &mut Engine, seen: &[Seen]) -> Result<f64, RenderError> {
    engine.clear_film()?;
    let [width, height] = engine.size();
    let tiles = slot_count(width, height) as usize / TILE;
    let step = rest_step(tiles);
    for span in engine.whole_film() {
        // The same tiles in however many bands.
        let first_slot = (span.first_slot as usize / TILE).next_multiple_of(step) * TILE;
        let span = Span { first_slot: first_slot as u32, ..span };
        if span.first_slot < span.end_slot {
            let of_tile = |slot: u32| pixels_in(slot, span.end_slot.min(slot + TILE as u32), width, height);
            let pixels: u64 = (span.first_slot..span.end_slot).step_by(step * TILE).map(of_tile).sum();
            let work = Work { spans: vec![span], tile_step: step as u32, target_samples: 1, new_samples: 1 };
            engine.work_until(work, engine.statistics.samples + pixels)?;
        }
    }
    let spans = engine.spans_of((0..tiles).step_by(step));
    let (mut sum, mut count) = (0.0, 0);
    engine.read_slots(&spans, |first, slots| {
        for (slot, number) in slots.iter().zip(first..) {
            let unlit = pixel_of_slot(number, width, height).is_some_and(|pixel| seen[pixel].emitted == 0.0);
            if unlit {
                sum += brightness(slot);
                count += 1;
            }
        }
    })?;
    Ok(if count > 0 { sum / f64::from(count) } else { 0.0 })
}

/// Of the sum of a slot's samples.
fn brightness(slot: &FilmSlot) -> f64 {
    (0..3).map(|channel| slot.total(channel)).sum()
}

/// The pixels of some tiles, which come in increasing order, and of those around.
fn pixels_around(tiles: &[usize], width: u32, height: u32) -> Vec<usize> {
    let mut around: Vec<_> = tiles.par_iter().flat_map_iter(|tile| tiles_around(*tile as u32, width, height)).collect();
    around.par_sort_unstable();
    around.dedup();
    let of_tile =
        |tile: usize| (tile * TILE..(tile + 1) * TILE).filter_map(|slot| pixel_of_slot(slot as u32, width, height));
    around.into_par_iter().flat_map_iter(of_tile).collect()
}

/// For an edge of so many times the brightness of the rest of the image. Multipliers are in proportion to deviations: at an edge that is
/// about half of the contrast, elsewhere about as much as all is bright.
fn multiplier_at_edge(contrast: f64) -> Multiplier {
    Multiplier::near((contrast / 2.0).log2()).max(Multiplier::ONE)
}

/// The greatest multiplier, `most` at most, with which the further samples of these pixels, of one that is asked for, stay within a budget.
fn greatest_within(pixels: &[(usize, Multiplier)], most: Multiplier, budget: f64) -> Multiplier {
    let further =
        |greatest: Multiplier| pixels.iter().map(|(_, m)| greatest.min(*m).factor() - 1.0).sum::<f64>() <= budget;
    let fits = |m: &&Multiplier| **m <= most && further(**m);
    Multiplier::ALL.iter().rev().find(fits).copied().unwrap_or_default()
}

/// Those `among` the pixels that differ from one of their neighbours, those across a corner included, and by how much at most; in
/// increasing order.
fn edges(seen: &[Seen], width: usize, among: &[usize]) -> Vec<(usize, f64)> {
    let height = seen.len() / width;
    let around = |i: usize, end: usize| i.saturating_sub(1)..(i + 2).min(end);
    let contrast = |&p: &usize| {
        let (x, y) = (p % width, p / width);
        let neighbours = around(y, height).flat_map(|y| around(x, width).map(move |x| y * width + x));
        let contrast = neighbours.map(|q| (seen[q].emitted - seen[p].emitted).abs()).fold(0.0, f64::max);
        (contrast > 0.0).then_some((p, contrast / f64::from(FIRST_SAMPLES)))
    };
    let mut found: Vec<_> = among.par_iter().filter_map(contrast).collect();
    found.par_sort_unstable_by_key(|(pixel, _)| *pixel);
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_beside_an_edge_are_found() {
        let pixels = pixels_around(&[0], 7, 5);
        let found = |seen: &[Seen]| edges(seen, 7, &pixels);
        let emitting = |mean: f64| Seen { emitted: f64::from(FIRST_SAMPLES) * mean, ..Seen::default() };
        let mut seen = vec![emitting(1.5); 35];
        assert!(found(&seen).is_empty());
        seen[2 * 7 + 3] = emitting(3.5);
        assert_eq!(found(&seen), [9, 10, 11, 16, 17, 18, 23, 24, 25].map(|pixel| (pixel, 2.0)));
        // In a corner.
        seen[17] = emitting(1.5);
        seen[34] = emitting(0.0);
        assert_eq!(found(&seen), [26, 27, 33, 34].map(|pixel| (pixel, 1.5)));
        assert!(edges(&[emitting(9.0)], 1, &[0]).is_empty());
    }

    #[test]
    fn edges_of_bright_emitters_get_more_samples() {
        let of = [0.0, 2.8, 2.9, 9.0, 1e9, f64::NAN, f64::INFINITY].map(|contrast| multiplier_at_edge(contrast).of(1));
        assert_eq!(of, [1, 1, 2, 4, 32, 1, 32]);
    }

    #[test]
    fn many_edges_get_fewer_samples_each() {
        let edges = |pixels| (0..pixels).map(|pixel| (pixel, Multiplier::near(5.0))).collect::<Vec<_>>();
        let within = |pixels, budget| greatest_within(&edges(pixels), Multiplier::near(5.0), budget).of(1);
        assert_eq!([310.0, 309.0, 30.0, 9.0].map(|budget| within(10, budget)), [32, 16, 4, 1]);
        assert_eq!(greatest_within(&edges(10), Multiplier::FOUR, 1e9), Multiplier::FOUR);
    }

    #[test]
    fn pixels_beside_tiles_are_looked_at_too() {
        // Two columns and rows of tiles and a part of a third.
        let around = |tiles: &[usize]| pixels_around(tiles, 20, 17);
        assert_eq!(around(&[0]).len(), 16 * 16);
        assert_eq!(around(&[5]).len(), 20 * 17);
        assert!(around(&[]).is_empty());
    }

    #[test]
    fn few_tiles_tell_of_the_rest() {
        assert_eq!([1, 1024, 16_384, 1 << 20].map(rest_step), [15, 15, 129, 8193]);
    }

    #[test]
    fn one_sample_looks_for_few_emitters() {
        let pays = |size| [1, 2, u32::MAX].map(|samples| pays(32, size, samples));
        assert_eq!(pays([64, 32]), [false, true, true]);
        assert_eq!(pays([64, 56]), [false, true, true]);
        assert_eq!(pays([64, 57]), [true; 3]);
    }

    #[test]
    fn tiles_of_emitters_are_those_of_their_pixels() {
        // Four columns of tiles in a block of eight rows, which is 32 columns and 64 rows of pixels.
        let of = |pixels: &[Rectangle]| tiles_of(pixels, [60, 70]);
        assert!(of(&[]).is_empty() && of(&[[3..3, 0..9]]).is_empty());
        assert_eq!(of(&[[0..1, 0..1]]), [0]);
        assert_eq!(of(&[[7..9, 8..10]]), [4, 5]);
        // Twice the same, and one that ends where the image does: gaps of a row are filled, others are not.
        assert_eq!(of(&[[0..8, 0..16], [0..8, 0..16], [56..60, 69..70]]), [0, 1, 2, 3, 4, 99]);
        let all = of(&[[0..60, 0..70]]);
        assert!(all.len() >= 8 * 9 && all.is_sorted_by(|a, b| a < b));
    }
}
