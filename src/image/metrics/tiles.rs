//! Square tiles of an image.

/// Side of the tiles over which statistics are taken, pixels.
pub const TILE_SIDE: u32 = 16;

/// A tile: columns and rows, cut off at the image's edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Tile {
    pub x: u32,
    pub y: u32,
    width: u32,
    height: u32,
    stride: u32,
}

impl Tile {
    /// Indices of the tile's pixels.
    pub fn indices(self) -> impl Iterator<Item = usize> {
        (self.y..self.y + self.height).flat_map(move |y| {
            let start = y as usize * self.stride as usize + self.x as usize;
            start..start + self.width as usize
        })
    }
}

/// Covers an image with tiles, row by row.
pub(super) fn tiles(width: u32, height: u32, side: u32) -> impl Iterator<Item = Tile> {
    let step = side as usize;
    (0..height).step_by(step).flat_map(move |y| {
        (0..width).step_by(step).map(move |x| Tile {
            x,
            y,
            width: side.min(width - x),
            height: side.min(height - y),
            stride: width,
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_cover_each_pixel_once() {
        for (width, height, side) in [(33, 17, 16), (16, 16, 16), (1, 5, 2), (7, 3, 100)] {
            let mut seen = vec![0; (width * height) as usize];
            tiles(width, height, side).flat_map(Tile::indices).for_each(|i| seen[i] += 1);
            assert!(seen.iter().all(|&n| n == 1), "{width}x{height} by {side}");
            assert_eq!(tiles(width, height, side).count() as u32, width.div_ceil(side) * height.div_ceil(side));
        }
    }
}
