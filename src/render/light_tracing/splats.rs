//! What light paths light, summed up on the host.

use rayon::prelude::*;

use crate::render::film::Film;
use crate::render::kernel::layout::SplatRecord;

/// Threads that add up records, where there are many.
const THREADS: usize = 8;
/// From so many on several threads take less time, woken up as they must be.
const MANY_LIGHT_PATHS: usize = 1 << 16;

/// What the light paths of a dispatch have recorded: first the first records of all, then the second ones, and so on.
#[derive(Clone, Copy)]
pub(crate) struct SplatRecords<'a> {
    records: &'a [SplatRecord],
    light_paths: usize,
}

impl<'a> SplatRecords<'a> {
    /// [`SplatRecord::MOST`] records for each light path.
    pub fn of(records: &'a [SplatRecord]) -> Self {
        Self { records, light_paths: records.len() / SplatRecord::MOST as usize }
    }

    /// Whether some light path ran out of loop budget.
    pub fn are_unfinished(self) -> bool {
        self.records[..self.light_paths].iter().any(|first| first.pixel == SplatRecord::UNFINISHED)
    }

    /// Those of a light path.
    fn of_light_path(self, light_path: usize) -> impl Iterator<Item = SplatRecord> + use<'a> {
        let mut at = light_path;
        std::iter::from_fn(move || {
            let record = *self.records.get(at)?;
            at += self.light_paths;
            (record.pixel != SplatRecord::NO_PIXEL).then_some(record)
        })
    }
}

/// Light of light paths by pixel, row by row.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Splats {
    /// Light paths so far.
    pub light_paths: u64,
    /// What they light; empty if there are to be none.
    pub sums: Vec<[f64; 3]>,
}

impl Splats {
    /// None yet, on so many pixels.
    pub fn new(pixels: usize) -> Self {
        Self { light_paths: 0, sums: vec![[0.0; 3]; pixels] }
    }

    /// Takes over light paths, in their order.
    pub fn add(&mut self, records: SplatRecords<'_>) {
        self.light_paths += records.light_paths as u64;
        add_to(&mut self.sums, records, threads(records.light_paths));
    }

    /// What they add to the mean of a pixel.
    fn mean(&self, pixel: usize) -> [f32; 3] {
        let light_paths = self.light_paths.max(1) as f64;
        self.sums.get(pixel).map_or([0.0; 3], |sum| sum.map(|sum| (sum / light_paths) as f32))
    }

    /// Adds them to the mean of each pixel of a film.
    pub fn add_to(&self, film: &mut Film) {
        if self.light_paths > 0 {
            film.add(|pixel, _| self.mean(pixel));
        }
    }
}

/// How many threads are to add up what so many light paths have recorded. Each looks at all records, so that few take longer than one: on two cores
/// both take 22 to 30 ns a light path and one 15 (Zen 4), on sixteen of another machine one 33, eight 20 and sixteen 19 (an H200's host).
fn threads(light_paths: usize) -> usize {
    if light_paths >= MANY_LIGHT_PATHS && rayon::current_num_threads() >= 2 * THREADS { THREADS } else { 1 }
}

/// Adds records to those of their pixels that there are, by so many threads, each with a part of the pixels.
fn add_to(sums: &mut [[f64; 3]], records: SplatRecords<'_>, threads: usize) {
    let part = sums.len().div_ceil(threads).max(1);
    let add = |(i, sums): (usize, &mut [[f64; 3]])| {
        for light_path in 0..records.light_paths {
            for record in records.of_light_path(light_path) {
                if let Some(sum) = sums.get_mut((record.pixel as usize).wrapping_sub(i * part)) {
                    sum.iter_mut().zip(record.light).for_each(|(sum, light)| *sum += f64::from(light));
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

    fn light_path(records: &[(u32, f32)]) -> Vec<SplatRecord> {
        let mut all = vec![SplatRecord { light: [9.0; 3], pixel: 0 }; SplatRecord::MOST as usize];
        for (record, &(pixel, light)) in all.iter_mut().zip(records) {
            *record = SplatRecord { light: [light, 2.0 * light, 0.0], pixel };
        }
        if let Some(after) = all.get_mut(records.len()) {
            after.pixel = SplatRecord::NO_PIXEL;
        }
        all
    }

    #[test]
    fn light_is_that_of_the_light_paths() {
        let mut light = Splats::new(2);
        // Pixel 0 gets 1, 0, 1, 0 and pixel 1 gets 0, 0.5 + 0.5, 0, 0; a pixel beyond the image nothing.
        let all: [&[(u32, f32)]; 4] = [&[(0, 1.0)], &[(1, 0.5), (1, 0.5)], &[(0, 1.0), (2, 7.0)], &[]];
        for records in all {
            light.add(SplatRecords::of(&light_path(records)));
        }
        assert_eq!(light.light_paths, 4);
        assert_eq!([0, 1].map(|pixel| light.mean(pixel)), [[0.5, 1.0, 0.0], [0.25, 0.5, 0.0]]);
        let mut film = Film::new(2, 1);
        film.put(0, [3.0, 0.0, 0.0], 2);
        light.add_to(&mut film);
        assert_eq!(film.mean(), [[2.0, 1.0, 0.0], [0.0; 3]]);
        Splats::default().add_to(&mut film);
        assert_eq!(film.mean()[0], [2.0, 1.0, 0.0]);
    }

    #[test]
    fn records_of_several_light_paths_are_told_apart() {
        let light_paths = [light_path(&[(0, 1.0), (1, 2.0), (1, 3.0)]), light_path(&[]), light_path(&[(1, 4.0)])];
        let records: Vec<_> = (0..SplatRecord::MOST as usize)
            .flat_map(|i| light_paths.each_ref().map(|light_path| light_path[i]))
            .collect();
        let of_light_path =
            |i: usize| SplatRecords::of(&records).of_light_path(i).map(|record| record.light[0]).collect::<Vec<_>>();
        assert_eq!([0, 1, 2].map(of_light_path), [vec![1.0, 2.0, 3.0], vec![], vec![4.0]]);
        let mut light = Splats::new(2);
        light.add(SplatRecords::of(&records));
        assert_eq!((light.light_paths, light.mean(1)[0]), (3, 3.0));
        assert!(!SplatRecords::of(&records).are_unfinished() && !SplatRecords::of(&[]).are_unfinished());
        // Only a light path's first record tells.
        let marked = |i: usize| {
            let mut records = records.clone();
            records[i].pixel = SplatRecord::UNFINISHED;
            SplatRecords::of(&records).are_unfinished()
        };
        assert_eq!([1, 2, 3, 5].map(marked), [true, true, false, false]);
    }

    #[test]
    fn any_number_of_threads_adds_up_the_same() {
        let mut random = crate::accel::random_numbers(3);
        let mut place = || (12.0 * random()) as u32;
        let records: Vec<_> = (0..50 * SplatRecord::MOST)
            .map(|i| SplatRecord { light: [1.0 / (1.0 + i as f32), 0.0, 1.0], pixel: place() })
            .collect();
        let sums_by = |threads: usize| {
            let mut sums = vec![[0.0; 3]; 11];
            add_to(&mut sums, SplatRecords::of(&records), threads);
            sums
        };
        let by_one = sums_by(1);
        assert!(by_one.iter().all(|sum| sum[2] > 30.0), "{by_one:?}");
        assert_eq!([2, 3, 8, 40].map(sums_by), [(); 4].map(|()| by_one.clone()));
    }

    #[test]
    fn a_light_path_of_all_records_has_no_end_mark() {
        let mut light = Splats::new(1);
        light.add(SplatRecords::of(&light_path(&[(0, 1.0); SplatRecord::MOST as usize])));
        assert_eq!(light.mean(0), [16.0, 32.0, 0.0]);
        assert_eq!(Splats::new(1).mean(0), [0.0; 3]);
    }
}
