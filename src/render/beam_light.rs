//! What beams light, summed up on the host.

use crate::image::metrics::RELATIVE_OFFSET;

use super::film::Film;
use super::layout::BeamNote;

/// Light of beams by pixel, row by row.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct BeamLight {
    /// Beams so far.
    pub beams: u64,
    sums: Vec<[f64; 3]>,
    /// None unless noise is asked for.
    squares: Vec<[f64; 3]>,
}

impl BeamLight {
    /// None yet, on so many pixels.
    pub fn new(pixels: usize) -> Self {
        Self { beams: 0, sums: vec![[0.0; 3]; pixels], squares: Vec::new() }
    }

    /// The same, such that [`Self::noise`] is known.
    pub fn with_noise(pixels: usize) -> Self {
        Self { squares: vec![[0.0; 3]; pixels], ..Self::new(pixels) }
    }

    /// Takes over beams: [`BeamNote::MOST`] notes of each.
    pub fn add(&mut self, notes: &[BeamNote]) {
        for beam in notes.chunks_exact(BeamNote::MOST as usize) {
            self.beams += 1;
            for note in beam.iter().take_while(|note| note.pixel != BeamNote::NO_PIXEL) {
                let pixel = note.pixel as usize;
                let light = note.light.map(f64::from);
                if let Some(sum) = self.sums.get_mut(pixel) {
                    sum.iter_mut().zip(light).for_each(|(sum, light)| *sum += light);
                }
                if let Some(square) = self.squares.get_mut(pixel) {
                    square.iter_mut().zip(light).for_each(|(square, light)| *square += light * light);
                }
            }
        }
    }

    /// What they add to the mean of each pixel.
    pub fn mean(&self) -> impl Iterator<Item = [f32; 3]> {
        let beams = self.beams.max(1) as f64;
        self.sums.iter().map(move |sum| sum.map(|s| (s / beams) as f32))
    }

    /// Their part of the noise of an image once they are added to its film: the mean of v/(x² + 0.01), x being a radiance of the image,
    /// and v the variance of what they add to it. 0 if squares are not kept.
    pub fn noise(&self, film: &Film) -> f64 {
        if self.squares.is_empty() {
            return 0.0;
        }
        let beams = self.beams.max(1) as f64;
        let of_pixel = |((sum, square), x): ((&[f64; 3], &[f64; 3]), [f32; 3])| -> f64 {
            let variance = |c: usize| (square[c] - sum[c] * sum[c] / beams).max(0.0) / (beams * beams);
            let radiance = |c: usize| f64::from(x[c]) + sum[c] / beams;
            (0..3).map(|c| variance(c) / (radiance(c).powi(2) + RELATIVE_OFFSET)).sum()
        };
        let total: f64 = self.sums.iter().zip(&self.squares).zip(film.mean()).map(of_pixel).sum();
        total / (3 * self.sums.len()).max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn beam(notes: &[(u32, f32)]) -> Vec<BeamNote> {
        let mut all = vec![BeamNote { light: [9.0; 3], pixel: 0 }; BeamNote::MOST as usize];
        for (note, &(pixel, light)) in all.iter_mut().zip(notes) {
            *note = BeamNote { light: [light, 2.0 * light, 0.0], pixel };
        }
        if let Some(after) = all.get_mut(notes.len()) {
            after.pixel = BeamNote::NO_PIXEL;
        }
        all
    }

    #[test]
    fn light_and_noise_are_those_of_the_beams() {
        let mut light = BeamLight::with_noise(2);
        // Pixel 0 gets 1, 0, 1, 0 and pixel 1 gets 0, 0.5 + 0.5, 0, 0; a pixel beyond the image nothing.
        let all: [&[(u32, f32)]; 4] = [&[(0, 1.0)], &[(1, 0.5), (1, 0.5)], &[(0, 1.0), (2, 7.0)], &[]];
        for notes in all {
            light.add(&beam(notes));
        }
        assert_eq!(light.beams, 4);
        assert_eq!(light.mean().collect::<Vec<_>>(), [[0.5, 1.0, 0.0], [0.25, 0.5, 0.0]]);
        let mut film = Film::new(2, 1);
        film.put(0, [3.0, 0.0, 0.0], 1);
        film.put(1, [0.0; 3], 0);
        // Of pixel 0: (2 − 4/4)/16 in red, four times as much in green; of pixel 1 (0.5 − 1/4)/16 and four times that.
        let (first, second) = (1.0 / 16.0, 0.25 / 16.0);
        let relative = |v: f64, x: f64| v / (x * x + RELATIVE_OFFSET);
        let of_first = relative(first, 3.0 + 0.5) + relative(4.0 * first, 1.0);
        let expected = (of_first + relative(second, 0.25) + relative(4.0 * second, 0.5)) / 6.0;
        assert!((light.noise(&film) / expected - 1.0).abs() < 1e-12, "{} and {expected}", light.noise(&film));
    }

    #[test]
    fn a_beam_of_all_notes_has_no_end_mark() {
        let mut light = BeamLight::with_noise(1);
        light.add(&beam(&[(0, 1.0); BeamNote::MOST as usize]));
        assert_eq!(light.mean().collect::<Vec<_>>(), [[16.0, 32.0, 0.0]]);
        assert_eq!(BeamLight::with_noise(1).mean().collect::<Vec<_>>(), [[0.0; 3]]);
    }
}
