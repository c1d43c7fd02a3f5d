//! What beams light, summed up on the host.

use crate::image::metrics::RELATIVE_OFFSET;

use super::film::Film;
use super::layout::BeamNote;

/// Light of beams by pixel, row by row: the mean of one part, or of two that have no beam in common, so that either can decide how many
/// beams the other gets.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct BeamLight {
    /// Of equal weight, whatever their numbers of beams.
    pub parts: Vec<BeamPart>,
}

impl BeamLight {
    /// None yet, on so many pixels: one part.
    pub fn new(pixels: usize) -> Self {
        Self::of(0, vec![[0.0; 3]; pixels])
    }

    /// Some, that have been summed up before: one part.
    pub fn of(beams: u64, sums: Vec<[f64; 3]>) -> Self {
        Self { parts: vec![BeamPart { beams, sums, squares: Vec::new() }] }
    }

    /// The beams of the first part, and their sums.
    pub fn first_part(&self) -> (u64, &[[f64; 3]]) {
        self.parts.first().map_or((0, &[]), |part| (part.beams, &part.sums))
    }

    /// The same, such that [`Self::noise`] is known: two parts.
    pub fn with_noise(pixels: usize) -> Self {
        let part = BeamPart { beams: 0, sums: vec![[0.0; 3]; pixels], squares: vec![[0.0; 3]; pixels] };
        Self { parts: vec![part; 2] }
    }

    /// Beams so far.
    pub fn beams(&self) -> u64 {
        self.parts.iter().map(|part| part.beams).sum()
    }

    /// What they add to the mean of each pixel.
    pub fn mean(&self) -> Vec<[f32; 3]> {
        let mut mean: Vec<_> = self.parts[0].mean().collect();
        for part in &self.parts[1..] {
            mean.iter_mut().zip(part.mean()).for_each(|(sum, x)| (0..3).for_each(|c| sum[c] += x[c]));
        }
        let parts = self.parts.len() as f64;
        mean.into_iter().map(|sum| sum.map(|s| (s / parts) as f32)).collect()
    }

    /// Their part of the noise of an image once they are added to its film: see [`BeamPart::noise`]. 0 if there is one part.
    pub fn noise(&self, film: &Film) -> f64 {
        let total: f64 = self.parts.iter().map(|part| part.noise(film)).sum();
        total / (self.parts.len() as f64).powi(2)
    }

    /// How many beams each part should have for that noise, as the other one tells. 0 if there is one part.
    pub fn beams_for_noise(&self, film: &Film, noise: f64) -> Vec<u64> {
        // Each part's noise counts a quarter.
        let of_each = 2.0 * noise;
        let wanted = |other: &BeamPart| (other.beams as f64 * other.noise(film) / of_each).ceil() as u64;
        self.parts.iter().rev().map(wanted).collect()
    }
}

/// Beams that no other part has, and what they have lit.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct BeamPart {
    /// Beams so far.
    pub beams: u64,
    sums: Vec<[f64; 3]>,
    /// None unless noise is asked for.
    squares: Vec<[f64; 3]>,
}

impl BeamPart {
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

    /// What they add to the mean of each pixel, if this is the only part.
    fn mean(&self) -> impl Iterator<Item = [f64; 3]> {
        let beams = self.beams.max(1) as f64;
        self.sums.iter().map(move |sum| sum.map(|s| s / beams))
    }

    /// Its noise in an image to whose film it alone is added: the mean of v/(x² + 0.01), x being a radiance of the image, and v the
    /// variance of what it adds. 0 if squares are not kept.
    fn noise(&self, film: &Film) -> f64 {
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
        let mut light = BeamLight::with_noise(2).parts.remove(0);
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
        let mut light = BeamLight::new(1);
        light.parts[0].add(&beam(&[(0, 1.0); BeamNote::MOST as usize]));
        assert_eq!(light.mean(), [[16.0, 32.0, 0.0]]);
        assert_eq!(BeamLight::with_noise(1).mean(), [[0.0; 3]]);
    }

    #[test]
    fn either_part_decides_about_the_other() {
        let mut light = BeamLight::with_noise(1);
        [1.0, 0.0, 1.0, 0.0].into_iter().for_each(|x| light.parts[0].add(&beam(&[(0, x)])));
        [4.0, 4.0].into_iter().for_each(|x| light.parts[1].add(&beam(&[(0, x)])));
        // Parts of different numbers count the same.
        assert_eq!((light.beams(), light.mean()), (6, vec![[2.25, 4.5, 0.0]]));
        let film = Film::new(1, 1);
        let noise = light.noise(&film);
        assert_eq!(noise, light.parts[0].noise(&film) / 4.0);
        // The second one varies, as far as the first can tell, and has half of its beams. Twice the noise is allowed to it, were both to
        // vary alike; and the first needs none.
        assert_eq!(light.beams_for_noise(&film, noise), [0, 8]);
        assert_eq!(light.beams_for_noise(&film, 4.0 * noise), [0, 2]);
        assert_eq!(light.beams_for_noise(&film, f64::INFINITY), [0, 0]);
        assert_eq!(BeamLight::new(1).beams_for_noise(&film, 0.1), [0]);
    }
}
