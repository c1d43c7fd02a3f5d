//! What beams light, summed up on the host.

use rayon::prelude::*;

use crate::render::film::Film;
use crate::render::kernel::layout::BeamNote;

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

/// Light of beams by pixel, row by row.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct BeamLight {
    /// Beams so far.
    pub beams: u64,
    /// What they light; empty if there are to be none.
    pub sums: Vec<[f64; 3]>,
}

impl BeamLight {
    /// None yet, on so many pixels.
    pub fn new(pixels: usize) -> Self {
        Self { beams: 0, sums: vec![[0.0; 3]; pixels] }
    }

    /// Takes over beams, in their order.
    pub fn add(&mut self, notes: BeamNotes<'_>) {
        self.beams += notes.beams as u64;
        add_to(&mut self.sums, notes, threads(notes.beams));
    }

    /// What they add to the mean of a pixel.
    fn mean(&self, pixel: usize) -> [f32; 3] {
        let beams = self.beams.max(1) as f64;
        self.sums.get(pixel).map_or([0.0; 3], |sum| sum.map(|sum| (sum / beams) as f32))
    }

    /// Adds them to the mean of each pixel of a film.
    pub fn add_to(&self, film: &mut Film) {
        if self.beams > 0 {
            film.add(|pixel, _| self.mean(pixel));
        }
    }
}

/// How many threads are to add up what so many beams have noted. Each looks at all notes, so that few take longer than one: on two cores
/// both take 22 to 30 ns a beam and one 15 (Zen 4), on sixteen of another machine one 33, eight 20 and sixteen 19 (an H200's host).
fn threads(beams: usize) -> usize {
    if beams >= MANY_BEAMS && rayon::current_num_threads() >= 2 * THREADS { THREADS } else { 1 }
}

/// Adds notes to those of their pixels that there are, by so many threads, each with a part of the pixels.
fn add_to(sums: &mut [[f64; 3]], notes: BeamNotes<'_>, threads: usize) {
    let part = sums.len().div_ceil(threads).max(1);
    let add = |(i, sums): (usize, &mut [[f64; 3]])| {
        for beam in 0..notes.beams {
            for note in notes.of_beam(beam) {
                if let Some(sum) = sums.get_mut((note.pixel as usize).wrapping_sub(i * part)) {
                    sum.iter_mut().zip(note.light).for_each(|(sum, light)| *sum += f64::from(light));
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
    fn light_is_that_of_the_beams() {
        let mut light = BeamLight::new(2);
        // Pixel 0 gets 1, 0, 1, 0 and pixel 1 gets 0, 0.5 + 0.5, 0, 0; a pixel beyond the image nothing.
        let all: [&[(u32, f32)]; 4] = [&[(0, 1.0)], &[(1, 0.5), (1, 0.5)], &[(0, 1.0), (2, 7.0)], &[]];
        for notes in all {
            light.add(BeamNotes::of(&beam(notes)));
        }
        assert_eq!(light.beams, 4);
        assert_eq!([0, 1].map(|pixel| light.mean(pixel)), [[0.5, 1.0, 0.0], [0.25, 0.5, 0.0]]);
        let mut film = Film::new(2, 1);
        film.put(0, [3.0, 0.0, 0.0], 2);
        light.add_to(&mut film);
        assert_eq!(film.mean(), [[2.0, 1.0, 0.0], [0.0; 3]]);
        BeamLight::default().add_to(&mut film);
        assert_eq!(film.mean()[0], [2.0, 1.0, 0.0]);
    }

    #[test]
    fn notes_of_several_beams_are_told_apart() {
        let beams = [beam(&[(0, 1.0), (1, 2.0), (1, 3.0)]), beam(&[]), beam(&[(1, 4.0)])];
        let notes: Vec<_> = (0..BeamNote::MOST as usize).flat_map(|i| beams.each_ref().map(|beam| beam[i])).collect();
        let of_beam = |i: usize| BeamNotes::of(&notes).of_beam(i).map(|note| note.light[0]).collect::<Vec<_>>();
        assert_eq!([0, 1, 2].map(of_beam), [vec![1.0, 2.0, 3.0], vec![], vec![4.0]]);
        let mut light = BeamLight::new(2);
        light.add(BeamNotes::of(&notes));
        assert_eq!((light.beams, light.mean(1)[0]), (3, 3.0));
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
            add_to(&mut sums, BeamNotes::of(&notes), threads);
            sums
        };
        let by_one = sums_by(1);
        assert!(by_one.iter().all(|sum| sum[2] > 30.0), "{by_one:?}");
        assert_eq!([2, 3, 8, 40].map(sums_by), [(); 4].map(|()| by_one.clone()));
    }

    #[test]
    fn a_beam_of_all_notes_has_no_end_mark() {
        let mut light = BeamLight::new(1);
        light.add(BeamNotes::of(&beam(&[(0, 1.0); BeamNote::MOST as usize])));
        assert_eq!(light.mean(0), [16.0, 32.0, 0.0]);
        assert_eq!(BeamLight::new(1).mean(0), [0.0; 3]);
    }
}
