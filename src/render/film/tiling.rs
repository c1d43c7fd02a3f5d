//! The order of pixels in the film: slots, tiles and blocks (shaders/lib/pixel_order.glsl).

use rayon::prelude::*;

use crate::render::kernel::layout::queue;

/// Columns and rows of the blocks of pixels into which an image is cut, see shaders/lib/pixel_order.glsl.
pub(crate) const BLOCK: [u32; 2] = [32, 64];
/// Columns and rows of a tile.
pub(crate) const SIDE: u32 = 8;
/// Columns and rows of a group of pixels.
pub(crate) const GROUP: [u32; 2] = [4, 2];
/// Pixels of a group.
pub(crate) const MEMBERS: usize = (GROUP[0] * GROUP[1]) as usize;
/// Columns and rows of the groups of a tile.
pub(crate) const GROUPS: [u32; 2] = [SIDE / GROUP[0], SIDE / GROUP[1]];
/// All of them.
pub(crate) const TILE_GROUPS: u32 = GROUPS[0] * GROUPS[1];
/// Slots of a tile: the first member of each group, then the second, and so on.
pub(crate) const TILE_SLOTS: u32 = SIDE * SIDE;
/// The same, to index by.
pub(crate) const TILE: usize = TILE_SLOTS as usize;
/// Columns and rows of the tiles of a block.
const TILES: [u32; 2] = [BLOCK[0] / SIDE, BLOCK[1] / SIDE];
/// All of them.
pub(crate) const BLOCK_TILES: u32 = TILES[0] * TILES[1];

/// Slots of an image: its pixels in blocks, padded.
pub(crate) fn slot_count(width: u32, height: u32) -> u64 {
    slots_of_row(width) * u64::from(height.div_ceil(BLOCK[1]))
}

/// Slots of a row of blocks.
pub(crate) fn slots_of_row(width: u32) -> u64 {
    u64::from(BLOCK[0] * BLOCK[1]) * u64::from(width.div_ceil(BLOCK[0]))
}

/// Rows of pixels in whole rows of blocks.
pub(crate) fn rows_of_blocks(slots: u32, width: u32) -> u32 {
    (u64::from(slots) / slots_of_row(width)) as u32 * BLOCK[1]
}

/// The tile in a column and row of tiles.
fn tile_at(column: u32, row: u32, width: u32) -> u32 {
    let block = row / TILES[1] * width.div_ceil(BLOCK[0]) + column / TILES[0];
    TILES[0] * TILES[1] * block + row % TILES[1] * TILES[0] + column % TILES[0]
}

/// The tile of the pixel in column `x` and row `y`.
pub(crate) fn tile_of_pixel(x: u32, y: u32, width: u32) -> u32 {
    tile_at(x / SIDE, y / SIDE, width)
}

/// The column and row of tiles in which a tile is.
pub(crate) fn place_of_tile(tile: u32, width: u32) -> [u32; 2] {
    tile_corner(tile, width).map(|x| x / SIDE)
}

/// The upper left pixel of a tile, which may lie outside the image.
pub(crate) fn tile_corner(tile: u32, width: u32) -> [u32; 2] {
    let blocks_x = width.div_ceil(BLOCK[0]);
    let (block, within) = (tile / (TILES[0] * TILES[1]), tile % (TILES[0] * TILES[1]));
    let [column, row] = [within % TILES[0], within / TILES[0]];
    [BLOCK[0] * (block % blocks_x) + SIDE * column, BLOCK[1] * (block / blocks_x) + SIDE * row]
}

/// The tiles that touch a tile, itself included, in increasing order.
pub(crate) fn tiles_around(tile: u32, width: u32, height: u32) -> Vec<usize> {
    let mut found: Vec<_> = tiles_within(1, tile, width, height).map(|(tile, _)| tile).collect();
    found.sort_unstable();
    found
}

/// The tiles of the columns and rows within `reach` of a tile's, itself included, row by row, and how many columns and rows
/// away each is.
pub(crate) fn tiles_within(reach: u32, tile: u32, width: u32, height: u32) -> impl Iterator<Item = (usize, u32)> {
    let [x, y] = place_of_tile(tile, width);
    let size = [width.div_ceil(BLOCK[0]) * TILES[0], height.div_ceil(BLOCK[1]) * TILES[1]];
    let near = move |at: u32, size: u32| at.saturating_sub(reach)..=(at + reach).min(size - 1);
    let in_row = move |row: u32| {
        near(x, size[0]).map(move |column| (tile_at(column, row, width) as usize, x.abs_diff(column) + y.abs_diff(row)))
    };
    near(y, size[1]).flat_map(in_row)
}

/// The tiles that pixels of an image are in, in increasing order.
pub(crate) fn tiles_of_pixels(pixels: &[usize], width: u32) -> Vec<usize> {
    let tile = |&pixel: &usize| tile_of_pixel(pixel as u32 % width, pixel as u32 / width, width) as usize;
    let mut tiles: Vec<_> = pixels.iter().map(tile).collect();
    tiles.sort_unstable();
    tiles.dedup();
    tiles
}

/// Pixels of whole tiles from slot `first` to slot `end`, which is not one of them.
pub(crate) fn pixels_in(first: u32, end: u32, width: u32, height: u32) -> u64 {
    let pixels = |tile: u32| {
        let [x, y] = tile_corner(tile, width);
        u64::from(width.saturating_sub(x).min(SIDE) * height.saturating_sub(y).min(SIDE))
    };
    (first / TILE_SLOTS..end / TILE_SLOTS).map(pixels).sum()
}

/// The pixel of a slot, row by row from the top left; `None` for padding.
pub(crate) fn pixel_of_slot(slot: u32, width: u32, height: u32) -> Option<usize> {
    let [x, y] = tile_corner(slot / TILE_SLOTS, width);
    let (group, member) = (slot % TILE_GROUPS, slot / TILE_GROUPS % MEMBERS as u32);
    let x = x + group % GROUPS[0] * GROUP[0] + member % GROUP[0];
    let y = y + group / GROUPS[0] * GROUP[1] + member / GROUP[0];
    (x < width && y < height).then(|| y as usize * width as usize + x as usize)
}

/// The slot of the pixel in column `x` and row `y`.
fn slot_of_pixel(x: u32, y: u32, width: u32) -> u32 {
    let group = x % SIDE / GROUP[0] + y % SIDE / GROUP[1] * GROUPS[0];
    let member = x % GROUP[0] + y % GROUP[1] * GROUP[0];
    tile_of_pixel(x, y, width) * TILE_SLOTS + member * TILE_GROUPS + group
}

/// Tiles of which one takes part in the pilot pass, made of a group of each.
pub(crate) const SET: u32 = queue::SCATTERED_TILES;
/// Slots of these.
pub(crate) const SET_SLOTS: u32 = TILE as u32 * SET;

/// So many slots are not worth to look for them in whole rows of blocks.
const FEW_SLOTS: usize = (BLOCK[0] * BLOCK[1]) as usize;

/// Hands slots, the first of which is slot `first`, to the pixels of an image that they stand for.
pub(crate) fn to_pixels<S: Sync, P: Send>(
    first: u32,
    slots: &[S],
    pixels: &mut [P],
    width: u32,
    put: impl Fn(&mut P, &S) + Sync,
) {
    let Some(last) = (slots.len() as u32).checked_sub(1).map(|more| first + more) else { return };
    if slots.len() <= FEW_SLOTS {
        let height = pixels.len() as u32 / width;
        for (slot, number) in slots.iter().zip(first..) {
            if let Some(pixel) = pixel_of_slot(number, width, height) {
                put(&mut pixels[pixel], slot);
            }
        }
        return;
    }
    // The rows of the blocks that they are in.
    let [top, bottom] =
        [first, last].map(|slot| (tile_corner(slot / TILE_SLOTS, width)[1] / BLOCK[1] * BLOCK[1]) as usize);
    let rows = pixels.par_chunks_mut(width as usize).enumerate().skip(top).take(bottom - top + BLOCK[1] as usize);
    rows.for_each(|(y, row)| {
        for (x, pixel) in row.iter_mut().enumerate() {
            let slot = slot_of_pixel(x as u32, y as u32, width);
            if let Some(slot) = slot.checked_sub(first).and_then(|i| slots.get(i as usize)) {
                put(pixel, slot);
            }
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_touch_each_other_mutually() {
        let (w, h) = (64, 40);
        let tiles = slot_count(w, h) as u32 / 64;
        for a in 0..tiles {
            let around = tiles_around(a, w, h);
            assert!([4, 6, 9].contains(&around.len()), "{a}: {around:?}");
            for &b in &around {
                assert!(tiles_around(b as u32, w, h).contains(&(a as usize)), "{a} and {b}");
            }
        }
    }

    #[test]
    fn pixels_are_in_few_tiles() {
        assert!(tiles_of_pixels(&[], 50).is_empty());
        // The first and the last pixel of an image of 50×70, and two beside the first.
        assert_eq!(tiles_of_pixels(&[3499, 0, 50, 1], 50), [0, tile_of_pixel(49, 69, 50) as usize]);
    }

    #[test]
    fn slots_cover_every_pixel_once() {
        for (w, h) in [(1, 1), (8, 8), (13, 21), (64, 3), (50, 70), (100, 140)] {
            let mut seen = vec![0; (w * h) as usize];
            for slot in 0..slot_count(w, h) as u32 {
                if let Some(p) = pixel_of_slot(slot, w, h) {
                    seen[p] += 1;
                }
            }
            assert!(seen.iter().all(|&n| n == 1), "{w}×{h}");
            let numbers: Vec<_> = (0..slot_count(w, h) as u32).collect();
            let mut slots_of_pixels = vec![u32::MAX; (w * h) as usize];
            // In parts, as of bands: few slots, and more that begin and end in the midst of rows.
            for slots in [192, FEW_SLOTS + 64] {
                slots_of_pixels.fill(u32::MAX);
                for part in numbers.chunks(slots) {
                    to_pixels(part[0], part, &mut slots_of_pixels, w, |pixel, slot| *pixel = *slot);
                }
                let are_right =
                    slots_of_pixels.iter().enumerate().all(|(p, slot)| pixel_of_slot(*slot, w, h) == Some(p));
                assert!(are_right, "{w}×{h} in parts of {slots}");
            }
            let slots = slot_count(w, h) as u32;
            assert_eq!(pixels_in(0, slots, w, h), u64::from(w * h));
            let inside = |slot: &u32| pixel_of_slot(*slot, w, h).is_some();
            let last = (slots - 64..slots).filter(inside).count() as u64;
            assert_eq!(pixels_in(slots - 64, slots, w, h), last, "{w}×{h}");
        }
    }
}
