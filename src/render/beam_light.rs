//! What beams light, summed up on the host.

use rayon::prelude::*;

use crate::image::metrics::RELATIVE_OFFSET;

use super::film::Film;
use super::layout::BeamNote;

/// Threads that add up notes, where there are many.
const THREADS: usize = 8;
/// From so many on several threads take less time, woken up as they must be.
const MANY_BEAMS: usize = 1 << 16;

/// What the beams of a dispatch have noted: first the first notes of all, then the second ones, and so on.
#[derive(Clone, Copy)]
pub(crate) struct BeamNotes<'a> {
    notes: &'a [BeamNote],
    beams: usize,
}

impl<'a> BeamNotes<'a> {
    /// [`BeamNote::MOST`] notes for each beam.
    pub fn of(notes: &'a [BeamNote]) -> Self {
        Self { notes, beams: notes.len() / BeamNote::MOST as usize }
    }

    /// Whether some beam ran out of loop budget.
    pub fn are_unfinished(self) -> bool {
        self.notes[..self.beams].iter().any(|first| first.pixel == BeamNote::UNFINISHED)
    }

    /// Those of a beam.
    fn of_beam(self, beam: usize) -> impl Iterator<Item = BeamNote> + use<'a> {
        let mut at = beam;
        std::iter::from_fn(move || {
            let note = *self.notes.get(at)?;
            at += self.beams;
            (note.pixel != BeamNote::NO_PIXEL).then_some(note)
        })
    }
}

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

    /// What they add to the mean of a pixel.
    pub fn mean(&self, pixel: usize) -> [f32; 3] {
        let mut mean = [0.0; 3];
        for part in &self.parts {
            mean.iter_mut().zip(part.mean(pixel)).for_each(|(mean, light)| *mean += light / self.parts.len() as f64);
        }
        mean.map(|light| light as f32)
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
    /// Takes over beams, in their order.
    pub fn add(&mut self, notes: BeamNotes<'_>) {
        self.beams += notes.beams as u64;
        let threads = threads(notes.beams);
        add_to(&mut self.sums, notes, threads, |light| light);
        add_to(&mut self.squares, notes, threads, |light| light * light);
    }

    /// What they add to the mean of a pixel, if this is the only part.
    fn mean(&self, pixel: usize) -> [f64; 3] {
        self.sums[pixel].map(|sum| sum / self.beams.max(1) as f64)
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

/// How many threads are to add up what so many beams have noted. Each looks at all notes, so that few take longer than one: on two cores
/// both take 22 to 30 ns a beam and one 15 (Zen 4), on sixteen of another machine one 33, eight 20 and sixteen 19 (an H200's host).
fn threads(beams: usize) -> usize {
    if beams >= MANY_BEAMS && rayon::current_num_threads() >= 2 * THREADS { THREADS } else { 1 }
}

/// Adds what notes amount to to those of their pixels that there are, by so many threads, each with a part of the pixels.
fn add_to(sums: &mut [[f64; 3]], notes: BeamNotes<'_>, threads: usize, amount: impl Fn(f64) -> f64 + Sync) {
    if sums.is_empty() {
        return;
    }
    let part = sums.len().div_ceil(threads);
    let add = |(i, sums): (usize, &mut [[f64; 3]])| {
        for beam in 0..notes.beams {
            for note in notes.of_beam(beam) {
                if let Some(sum) = sums.get_mut((note.pixel as usize).wrapping_sub(i * part)) {
                    sum.iter_mut().zip(note.light).for_each(|(sum, light)| *sum += amount(f64::from(light)));
                }
            }
        }
    };
    match threads {
        1 => add((0, sums)),
        _ => sums.par_chunks_mut(part).enumerate().for_each(add),
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
            light.add(BeamNotes::of(&beam(notes)));
        }
        assert_eq!(light.beams, 4);
        assert_eq!([0, 1].map(|pixel| light.mean(pixel)), [[0.5, 1.0, 0.0], [0.25, 0.5, 0.0]]);
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
    fn notes_of_several_beams_are_told_apart() {
        let beams = [beam(&[(0, 1.0), (1, 2.0), (1, 3.0)]), beam(&[]), beam(&[(1, 4.0)])];
        let notes: Vec<_> = (0..BeamNote::MOST as usize).flat_map(|i| beams.each_ref().map(|beam| beam[i])).collect();
        let of_beam = |i: usize| BeamNotes::of(&notes).of_beam(i).map(|note| note.light[0]).collect::<Vec<_>>();
        assert_eq!([0, 1, 2].map(of_beam), [vec![1.0, 2.0, 3.0], vec![], vec![4.0]]);
        let mut light = BeamLight::new(2);
        light.parts[0].add(BeamNotes::of(&notes));
        assert_eq!((light.beams(), light.mean(1)[0]), (3, 3.0));
        assert!(!BeamNotes::of(&notes).are_unfinished() && !BeamNotes::of(&[]).are_unfinished());
        // Only a beam's first note tells.
        let marked = |i: usize| {
            let mut notes = notes.clone();
            notes[i].pixel = BeamNote::UNFINISHED;
            BeamNotes::of(&notes).are_unfinished()
        };
        assert_eq!([1, 2, 3, 5].map(marked), [true, true, false, false]);
    }

    #[test]
    fn any_number_of_threads_adds_up_the_same() {
        let mut random = crate::accel::random_numbers(3);
        let mut place = || (12.0 * random()) as u32;
        let notes: Vec<_> = (0..50 * BeamNote::MOST)
            .map(|i| BeamNote { light: [1.0 / (1.0 + i as f32), 0.0, 1.0], pixel: place() })
            .collect();
        let sums_by = |threads: usize| {
            let mut sums = vec![[0.0; 3]; 11];
            add_to(&mut sums, BeamNotes::of(&notes), threads, |light| light);
            sums
        };
        let by_one = sums_by(1);
        assert!(by_one.iter().all(|sum| sum[2] > 30.0), "{by_one:?}");
        assert_eq!([2, 3, 8, 40].map(sums_by), [(); 4].map(|()| by_one.clone()));
    }

    #[test]
    fn a_beam_of_all_notes_has_no_end_mark() {
        let mut light = BeamLight::new(1);
        light.parts[0].add(BeamNotes::of(&beam(&[(0, 1.0); BeamNote::MOST as usize])));
        assert_eq!(light.mean(0), [16.0, 32.0, 0.0]);
        assert_eq!(BeamLight::with_noise(1).mean(0), [0.0; 3]);
    }

    #[test]
    fn either_part_decides_about_the_other() {
        let mut light = BeamLight::with_noise(1);
        [1.0, 0.0, 1.0, 0.0].into_iter().for_each(|x| light.parts[0].add(BeamNotes::of(&beam(&[(0, x)]))));
        [4.0, 4.0].into_iter().for_each(|x| light.parts[1].add(BeamNotes::of(&beam(&[(0, x)]))));
        // Parts of different numbers count the same.
        assert_eq!((light.beams(), light.mean(0)), (6, [2.25, 4.5, 0.0]));
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
