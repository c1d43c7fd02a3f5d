//! Slots of the film, and of what neighbours have in common, on their way between host and device.

use std::mem::{replace, take};

use bytemuck::Pod;
use rayon::prelude::*;

use crate::gpu::{Access, Buffer};
use crate::render::engine::Engine;
use crate::render::engine::buffers::{Band, IN_FLIGHT, Passage, mapped, unmapped};
use crate::render::error::RenderError;
use crate::render::film::Film;
use crate::render::kernel::layout::{FilmSlot, GradientSlot};
use crate::render::plan::dispatch::Span;

/// Parts of a passage: one is copied while the other is filled or read.
const HALVES: usize = 2;
// Each is in a submission of its own.
const _: () = assert!(HALVES <= IN_FLIGHT);

impl Engine {
    /// Fills spans of the film with what `slot` gives for each slot. The device must be idle.
    pub fn fill_film(&mut self, spans: &[Span], slot: impl Fn(u32) -> FilmSlot + Sync) -> Result<(), RenderError> {
        self.fill(|band| &mut band.film, spans, slot)
    }

    /// Fills spans of what neighbours have in common, likewise.
    pub fn fill_gradients(
        &mut self,
        spans: &[Span],
        slot: impl Fn(u32) -> GradientSlot + Sync,
    ) -> Result<(), RenderError> {
        self.fill(|band| &mut band.gradients, spans, slot)
    }

    /// Fills spans of one of the buffers of each band.
    fn fill<T: Pod + Send>(
        &mut self,
        of: impl Fn(&mut Band) -> &mut Buffer,
        spans: &[Span],
        slot: impl Fn(u32) -> T + Sync,
    ) -> Result<(), RenderError> {
        let fill = |span: &Span, slots: &mut [T]| {
            slots.par_iter_mut().enumerate().for_each(|(i, s)| *s = slot(span.first_slot + i as u32));
        };
        let bytes = |slots: u32| u64::from(slots) * size_of::<T>() as u64;
        let bands = &mut self.buffers.bands;
        let Some(Passage { to_device, most_slots, .. }) = &mut self.buffers.passage else {
            for span in spans {
                let band = &mut bands[span.band];
                let begin = bytes(span.first_slot - band.first) as usize;
                let target = of(band).mapped_mut().ok_or_else(unmapped)?;
                fill(span, bytemuck::cast_slice_mut(&mut target[begin..][..bytes(span.slots()) as usize]));
            }
            return Ok(());
        };
        // While one half is copied the other is filled.
        let mut tickets = [const { None }; HALVES];
        for (nth, load) in loads(spans, *most_slots).iter().enumerate() {
            if let Some(ticket) = tickets[nth % HALVES].take() {
                self.timeline.wait(&ticket)?;
            }
            let mut begin = half_begins::<T>(*most_slots, nth);
            let all = to_device.mapped_mut().ok_or_else(unmapped)?;
            let bytes_of_load = bytes(slots_of(load)) as usize;
            let mut rest: &mut [T] = bytemuck::cast_slice_mut(&mut all[begin as usize..][..bytes_of_load]);
            for span in load {
                let (slots, after) = take(&mut rest).split_at_mut(span.slots() as usize);
                fill(span, slots);
                rest = after;
            }
            tickets[nth % HALVES] = Some(self.timeline.submit(|r| {
                for span in load {
                    let (band, size) = (&mut bands[span.band], bytes(span.slots()));
                    let first = bytes(span.first_slot - band.first);
                    r.copy(to_device, begin, of(band), first, size);
                    begin += size;
                }
                r.barrier(Access::Transfer, Access::Compute);
            })?);
        }
        for ticket in tickets.iter().flatten() {
            self.timeline.wait(ticket)?;
        }
        Ok(())
    }

    /// The slots of the whole film, and of what neighbours have in common if there is any.
    pub fn save(&mut self, gradients: bool) -> Result<(Vec<FilmSlot>, Vec<GradientSlot>), RenderError> {
        let (whole, mut film, mut common) = (self.whole_film(), Vec::new(), Vec::new());
        self.read_slots(&whole, |_, slots| film.extend_from_slice(slots))?;
        if gradients {
            self.read_gradients(&whole, |_, slots| common.extend_from_slice(slots))?;
        }
        Ok((film, common))
    }

    /// Fills the whole film with what has been [saved](Self::save).
    pub fn load(&mut self, film: &[FilmSlot], gradients: &[GradientSlot]) -> Result<(), RenderError> {
        let whole = self.whole_film();
        self.fill_film(&whole, |slot| film[slot as usize])?;
        if gradients.is_empty() { Ok(()) } else { self.fill_gradients(&whole, |slot| gradients[slot as usize]) }
    }

    /// Reads the whole film.
    pub fn read_film(&mut self) -> Result<Film, RenderError> {
        let [width, height] = self.size();
        let mut film = Film::new(width, height);
        self.read_slots(&self.whole_film(), |first, slots| film.read_slots(first, slots))?;
        Ok(film)
    }

    /// Reads slots of the film; `visit` gets the slots of each span, in order, and the number of the first one: at once, or, of a long
    /// span, in parts.
    pub fn read_slots(&mut self, spans: &[Span], visit: impl FnMut(u32, &[FilmSlot])) -> Result<(), RenderError> {
        self.read(|band| &band.film, spans, visit)
    }

    /// Reads what neighbours have in common, likewise.
    pub fn read_gradients(
        &mut self,
        spans: &[Span],
        visit: impl FnMut(u32, &[GradientSlot]),
    ) -> Result<(), RenderError> {
        self.read(|band| &band.gradients, spans, visit)
    }

    /// Reads slots of one of the buffers of each band.
    fn read<T: Pod>(
        &mut self,
        of: impl Fn(&Band) -> &Buffer,
        spans: &[Span],
        mut visit: impl FnMut(u32, &[T]),
    ) -> Result<(), RenderError> {
        let bytes = |slots: u32| u64::from(slots) * size_of::<T>() as u64;
        let bands = &self.buffers.bands;
        let source = |span: &Span| (of(&bands[span.band]), bytes(span.first_slot - bands[span.band].first));
        let Some(Passage { from_device, most_slots, .. }) = &self.buffers.passage else {
            let ticket = self.timeline.submit(|r| r.barrier(Access::Compute, Access::Host))?;
            self.timeline.wait(&ticket)?;
            for span in spans {
                let (source, begin) = source(span);
                let slots = &mapped(source)?[begin as usize..][..bytes(span.slots()) as usize];
                visit(span.first_slot, bytemuck::cast_slice(slots));
            }
            return Ok(());
        };
        let loads = loads(spans, *most_slots);
        // While one half is visited the next load is copied to the other.
        let mut before = None;
        for nth in 0..=loads.len() {
            let copy = |load: &Vec<Span>| {
                self.timeline.submit(|r| {
                    r.barrier(Access::Compute, Access::Transfer);
                    let mut end = half_begins::<T>(*most_slots, nth);
                    for span in load {
                        let ((source, begin), size) = (source(span), bytes(span.slots()));
                        r.copy(source, begin, from_device, end, size);
                        end += size;
                    }
                    r.barrier(Access::Transfer, Access::Host);
                })
            };
            let ticket = loads.get(nth).map(copy).transpose()?;
            if let Some(copied) = replace(&mut before, ticket) {
                self.timeline.wait(&copied)?;
                let begin = half_begins::<T>(*most_slots, nth - 1) as usize;
                let bytes_of_load = bytes(slots_of(&loads[nth - 1])) as usize;
                let mut rest: &[T] = bytemuck::cast_slice(&mapped(from_device)?[begin..][..bytes_of_load]);
                for span in &loads[nth - 1] {
                    let (slots, after) = rest.split_at(span.slots() as usize);
                    visit(span.first_slot, slots);
                    rest = after;
                }
            }
        }
        Ok(())
    }
}

/// Slots of all spans of a load.
fn slots_of(load: &[Span]) -> u32 {
    load.iter().map(Span::slots).sum()
}

/// Where the half of a passage begins, in bytes, that the n-th load goes through, if each holds so many slots.
fn half_begins<T>(slots: u32, nth: usize) -> u64 {
    (nth % HALVES) as u64 * u64::from(slots) * size_of::<T>() as u64
}

/// Spans in their order, those of more than `most` slots in parts, put together to loads of up to so many slots.
fn loads(spans: &[Span], most: u32) -> Vec<Vec<Span>> {
    let mut loads: Vec<Vec<Span>> = Vec::new();
    let mut room = 0;
    for span in spans {
        for first_slot in (span.first_slot..span.end_slot).step_by(most as usize) {
            let part = Span { first_slot, end_slot: span.end_slot.min(first_slot + most), ..*span };
            match loads.last_mut() {
                Some(load) if part.slots() <= room => load.push(part),
                _ => {
                    loads.push(vec![part]);
                    room = most;
                }
            }
            room -= part.slots();
        }
    }
    loads
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_make_full_loads() {
        let span = |band, first_slot, end_slot| Span { band, first_slot, end_slot };
        assert!(loads(&[], 64).is_empty());
        let loads = loads(&[span(0, 0, 64), span(0, 128, 192), span(0, 192, 1000), span(1, 1000, 1064)], 256);
        let expected = [
            vec![span(0, 0, 64), span(0, 128, 192)],
            vec![span(0, 192, 448)],
            vec![span(0, 448, 704)],
            vec![span(0, 704, 960)],
            vec![span(0, 960, 1000), span(1, 1000, 1064)],
        ];
        assert_eq!(loads, expected);
    }
}
