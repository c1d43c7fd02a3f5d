//! Slots of the film, and of what neighbours have in common, on their way between host and device.

use bytemuck::Pod;
use rayon::prelude::*;

use super::super::error::RenderError;
use super::super::film::Film;
use super::super::layout::{FilmSlot, GradientSlot};
use super::super::plan::Span;
use super::Renderer;
use super::buffers::{Band, Passage};
use super::passes::{mapped, unmapped};
use crate::gpu::{Access, Buffer};

impl Renderer {
    /// Fills the film with what `slot` gives for each. The device must be idle.
    pub(super) fn fill_film(&mut self, slot: impl Fn(u32) -> FilmSlot + Sync) -> Result<(), RenderError> {
        self.fill(|band| &mut band.film, slot)
    }

    /// Fills what neighbours have in common, likewise.
    pub(super) fn fill_gradients(&mut self, slot: impl Fn(u32) -> GradientSlot + Sync) -> Result<(), RenderError> {
        self.fill(|band| &mut band.gradients, slot)
    }

    /// Fills one of the buffers of each band.
    fn fill<T: Pod + Send>(
        &mut self,
        of: impl Fn(&mut Band) -> &mut Buffer,
        slot: impl Fn(u32) -> T + Sync,
    ) -> Result<(), RenderError> {
        let fill = |first: u32, target: &mut [u8]| {
            let slots: &mut [T] = bytemuck::cast_slice_mut(target);
            slots.par_iter_mut().enumerate().for_each(|(i, s)| *s = slot(first + i as u32));
        };
        let bytes = |slots: u32| u64::from(slots) * size_of::<T>() as u64;
        for band in &mut self.buffers.bands {
            let (first, slots) = (band.first, band.slots);
            let buffer = of(band);
            let Some(Passage { to_device, most_slots, .. }) = &mut self.buffers.passage else {
                fill(first, &mut buffer.mapped_mut().ok_or_else(unmapped)?[..bytes(slots) as usize]);
                continue;
            };
            for begin in (0..slots).step_by(*most_slots as usize) {
                let size = bytes((slots - begin).min(*most_slots));
                fill(first + begin, &mut to_device.mapped_mut().ok_or_else(unmapped)?[..size as usize]);
                let ticket = self.timeline.submit(|r| {
                    r.copy(to_device, 0, buffer, bytes(begin), size);
                    r.barrier(Access::Transfer, Access::Compute);
                })?;
                self.timeline.wait(&ticket)?;
            }
        }
        Ok(())
    }

    /// Reads the whole film.
    pub(super) fn read_film(&mut self) -> Result<Film, RenderError> {
        let mut film = Film::new(self.width, self.height);
        self.read_slots(&self.whole_film(), |first, slots| film.read_slots(first, slots))?;
        Ok(film)
    }

    /// Reads slots of the film; `visit` gets the slots of each span, in order, and the number of the first one: at once, or, of a long
    /// span, in parts.
    pub(super) fn read_slots(
        &mut self,
        spans: &[Span],
        visit: impl FnMut(u32, &[FilmSlot]),
    ) -> Result<(), RenderError> {
        self.read(|band| &band.film, spans, visit)
    }

    /// Reads what neighbours have in common, likewise.
    pub(super) fn read_gradients(
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
        for load in loads(spans, *most_slots) {
            let ticket = self.timeline.submit(|r| {
                r.barrier(Access::Compute, Access::Transfer);
                let mut end = 0;
                for span in &load {
                    let ((source, begin), size) = (source(span), bytes(span.slots()));
                    r.copy(source, begin, from_device, end, size);
                    end += size;
                }
                r.barrier(Access::Transfer, Access::Host);
            })?;
            self.timeline.wait(&ticket)?;
            let total: u32 = load.iter().map(Span::slots).sum();
            let mut rest: &[T] = bytemuck::cast_slice(&mapped(from_device)?[..bytes(total) as usize]);
            for span in &load {
                let (slots, after) = rest.split_at(span.slots() as usize);
                visit(span.first_slot, slots);
                rest = after;
            }
        }
        Ok(())
    }
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
