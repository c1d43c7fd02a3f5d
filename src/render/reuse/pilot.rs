//! The pilot pass of a rendering, from which it is decided whether paths serve several pixels (shaders/lib/reuse.glsl), and where samples go.

use std::mem::take;
use std::ops::Range;

use rayon::prelude::*;

use crate::render::engine::Engine;
use crate::render::error::RenderError;
use crate::render::film::tiling::{MEMBERS, SET, SET_SLOTS, TILE, TILE_GROUPS, pixel_of_slot};
use crate::render::kernel::layout::{Push, mode, queue};
use crate::render::plan::dispatch::{Span, Work};
use crate::render::reuse::decision::ReuseDecision;
use crate::render::reuse::pilot_statistics::{GroupNoise, PilotGroup, PilotPair};
use crate::render::sampling::multiplier::Multiplier;

/// What the seed is changed by (XOR) in the pilot pass.
const SEED: u32 = 0x3707_3443;
/// Slots whose pilot pass is one dispatch: 131,072 samples.
const DISPATCH_SLOTS: u32 = 1024 * SET_SLOTS;

/// What came of a pilot pass.
#[derive(Default)]
pub(crate) struct PilotStatistics {
    pub reuse: ReuseDecision,
    /// Neighbours, if it is to be seen whether gradients pay.
    pub pairs: Vec<PilotPair>,
    /// Of each group, in the order of their slots.
    pub groups: Vec<GroupNoise>,
    /// Some samples were taken again: what they cost is not known.
    pub repeated: bool,
}

/// How many of the eight groups of each tile take part in the pilot pass of a rendering of so many samples per pixel: it takes a
/// sixty-fourth of the time, if these are many.
fn turns(samples: u32) -> u32 {
    (samples / 16).clamp(1, TILE_GROUPS)
}

/// The first slots of the groups of a set of tiles that take part in such turns of the pilot pass, tile by tile, as `slot_of_tile` of
/// shaders/lib/pixel_order.glsl has them.
fn groups_of_set(first_slot: u32, turns: Range<u32>) -> impl Iterator<Item = u32> {
    let group = |tile: u32, turn: u32| tile * TILE as u32 + (tile * 3 + turn) % TILE_GROUPS;
    (0..SET).flat_map(move |tile| turns.clone().map(move |turn| first_slot + group(tile, turn)))
}

/// How a pilot pass is made.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PilotOptions {
    /// How many of the eight groups of each tile take part: more than one only tell which tiles are to have more samples than others.
    turns: u32,
    /// Whether it is to be seen what neighbours have in common, for gradients.
    gradients: bool,
}

impl PilotOptions {
    /// For a rendering of so many samples per pixel. Tiles are told apart if samples are to be `allocated`.
    pub fn new(samples: u32, allocated: bool, gradients: bool) -> Self {
        Self { turns: if allocated { turns(samples) } else { 1 }, gradients }
    }
}

/// Before a rendering: tries reuse in a few groups of every tile, with other random numbers, so that nothing that is decided depends on
/// the image's. Pixels of which more samples are `wanted` for what they see, row by row, have no say. The film is left to the caller.
///
/// # Errors
/// The device fails, or the budget of loops does not suffice.
pub(crate) fn run_pilot(
    engine: &mut Engine,
    options: PilotOptions,
    wanted: &[Multiplier],
) -> Result<PilotStatistics, RenderError> {
    engine.clear_film()?;
    let correlated = if options.gradients { mode::CORRELATED } else { 0 };
    engine.look(
        |push| {
            push.seed ^= SEED;
            push.modes |= mode::SCATTERED | mode::REUSED | correlated;
        },
        |engine| pilot_samples(engine, options, wanted),
    )
}

fn pilot_samples(
    engine: &mut Engine,
    PilotOptions { turns, gradients }: PilotOptions,
    wanted: &[Multiplier],
) -> Result<PilotStatistics, RenderError> {
    let mut spans = Vec::new();
    for span in engine.whole_film() {
        let first_slot = span.first_slot;
        debug_assert!(first_slot.is_multiple_of(SET_SLOTS), "a band begins within a set of tiles");
        spans.extend((first_slot..span.end_slot).step_by(DISPATCH_SLOTS as usize).map(|first_slot| {
            let end_slot = span.end_slot.min(first_slot + DISPATCH_SLOTS);
            Span { first_slot, end_slot, ..span }
        }));
    }
    let [width, height] = engine.size();
    let mut end = engine.statistics.samples;
    let mut statistics = PilotStatistics::default();
    for (span, turn) in spans.iter().flat_map(|span| (0..turns).map(move |turn| (span, turn))) {
        end += pilot_pixels(span, turn, [width, height]) * u64::from(queue::PILOT_SAMPLES);
        let work = Work {
            spans: vec![*span],
            tile_step: SET,
            target_samples: queue::PILOT_SAMPLES,
            // At once, however many the others are to be: what they cost is recorded for a dispatch.
            new_samples: queue::PILOT_SAMPLES,
        };
        let set_turn = |push: &mut Push| push.modes |= turn << mode::TURN_SHIFT;
        statistics.repeated |= engine.with_push(set_turn, |engine| engine.work_until(work, end))?;
    }
    for span in spans {
        let mut groups = groups_of_span(engine, span, turns)?;
        groups.par_iter_mut().for_each(|group| {
            let pixel = |member| pixel_of_slot(group.slot(member), width, height);
            let is_wanted = |pixel: usize| wanted.get(pixel).is_some_and(|wanted| *wanted != Multiplier::ONE);
            group.left_out = std::array::from_fn(|member| pixel(member).is_none_or(is_wanted));
        });
        statistics.reuse.judge(&groups);
        if gradients {
            // One group of each tile tells enough.
            let first: Vec<_> = groups.chunk_by(|a, b| a.tile() == b.tile()).map(|of_tile| &of_tile[0]).collect();
            statistics.pairs.par_extend(first.par_iter().flat_map_iter(|group| group.pairs([width, height])));
        }
        statistics.groups.par_extend(groups.par_iter().map(PilotGroup::noise_of_pixels));
    }
    Ok(statistics)
}

/// The groups of a span after the pilot pass.
fn groups_of_span(engine: &mut Engine, span: Span, turns: u32) -> Result<Vec<PilotGroup>, RenderError> {
    let mut groups = Vec::new();
    engine.read_slots(&[span], |first, slots| {
        groups.par_extend(groups_among(slots.len(), turns).into_par_iter().map(|group| PilotGroup {
            first_slot: first + group,
            film: members_of(slots, group),
            gradients: Default::default(),
            left_out: Default::default(),
        }));
    })?;
    let mut rest = &mut groups[..];
    engine.read_gradients(&[span], |_, slots| {
        let among = groups_among(slots.len(), turns);
        let (these, after) = take(&mut rest).split_at_mut(among.len());
        let pairs = these.par_iter_mut().zip(among);
        pairs.for_each(|(groups, group)| groups.gradients = members_of(slots, group));
        rest = after;
    })?;
    Ok(groups)
}

/// Pixels of a span that take part in a turn of the pilot pass.
fn pilot_pixels(span: &Span, turn: u32, [width, height]: [u32; 2]) -> u64 {
    let members = |first: u32| (0..MEMBERS as u32).map(move |member| first + member * TILE_GROUPS);
    let sets = (span.first_slot..span.end_slot).step_by(SET_SLOTS as usize);
    let slots = sets.flat_map(|set| groups_of_set(set, turn..turn + 1)).flat_map(members);
    let inside = |slot: &u32| *slot < span.end_slot && pixel_of_slot(*slot, width, height).is_some();
    slots.filter(inside).count() as u64
}

/// The groups among so many slots, from the first of a set of tiles on, that take part in the pilot pass: their first slots.
fn groups_among(slots: usize, turns: u32) -> Vec<u32> {
    let sets = (0..slots as u32).step_by(SET_SLOTS as usize);
    sets.flat_map(|set| groups_of_set(set, 0..turns)).filter(|group| (*group as usize) < slots).collect()
}

/// What the members of a group have, of slots that are numbered from 0 on.
fn members_of<T: Copy>(slots: &[T], group: u32) -> [T; MEMBERS] {
    std::array::from_fn(|member| slots[group as usize + member * TILE_GROUPS as usize])
}
