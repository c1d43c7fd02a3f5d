//! What an engine keeps on the device.

use std::sync::Arc;

use crate::accel::Texel;
use crate::gpu::{Access, BindingKind, BindingLayout, BindingSet, Buffer, Device, Timeline, Usage};
use crate::render::error::RenderError;
use crate::render::film::tiling::{SET_SLOTS, slot_count, slots_of_row};
use crate::render::kernel::bindings::TableBuffers;
use crate::render::kernel::layout::{Counters, FilmSlot, GradientSlot, binding, queue};
use crate::render::plan::launch::Launch;
use crate::render::scene::tables::Tables;
use crate::render::settings::RenderSettings;

/// Submissions in flight, but for one that is repeated meanwhile.
pub(crate) const IN_FLIGHT: usize = 2;

/// What the path tracer's kernels see, besides what all do.
pub(crate) const BINDINGS: [(u32, BindingKind); 5] = [
    (binding::PATHS, BindingKind::Array),
    (binding::QUEUE_POOL, BindingKind::Array),
    (binding::PATH_TEXELS, BindingKind::StorageTexels),
    (binding::GRADIENTS, BindingKind::StorageTexels),
    (binding::GRADIENT_ROWS, BindingKind::Array),
];

/// Pixels of a band: 128 MiB, which an array may have on every device.
const MOST_BAND_SLOTS: u64 = (1 << 27) / size_of::<FilmSlot>() as u64;
const _: () = assert!(size_of::<GradientSlot>() <= size_of::<FilmSlot>(), "gradients are bound like the film");

/// What decides about sizes, besides the tables.
pub(crate) struct Shape {
    /// Of the film.
    pub slots: u64,
    /// Slots of a row of blocks, of which bands of the film are made if that is possible.
    pub row_slots: u64,
    /// Slots that a dispatch may cover.
    pub covered: u64,
    /// Workgroups of the queue that may run at one time; 0 without the queue.
    pub regions: u32,
    /// Samples that invocations note where several take those of a pixel.
    pub split_samples: u64,
    /// Whether paths may serve several pixels.
    pub reuse: bool,
    /// Whether paths note their hits in memory for that.
    pub records: bool,
    /// Bytes of the buffers through which the film is to pass, if the host is not to see it.
    pub passage: Option<u32>,
}

impl Shape {
    /// For an image of such a size.
    pub fn new(launch: &Launch, [width, height]: [u32; 2], settings: &RenderSettings) -> Self {
        let slots = slot_count(width, height);
        let covered = launch.most_slots();
        Self {
            slots,
            row_slots: slots_of_row(width),
            covered,
            regions: launch.regions(),
            split_samples: launch.split.recorded(slots.min(covered)),
            reuse: launch.kernel.reuse,
            records: launch.is_queued() && launch.kernel.reuse,
            passage: settings.passage,
        }
    }
}

/// A part of the film that fits into one texel buffer.
pub(crate) struct Band {
    pub first: u32,
    pub slots: u32,
    pub set: BindingSet,
    pub film: Buffer,
    /// Where paths may serve several pixels: what neighbours have in common.
    pub gradients: Buffer,
}

/// What slots of bands go through on their way, a part of a band at a time, where these are not mapped or it is asked for. (Memory
/// that the host sees is handed out slowly: .25 ms for a MiB, where a H100 copies as much in .05.)
pub(crate) struct Passage {
    pub to_device: Buffer,
    pub from_device: Buffer,
    /// Slots that there is room for, or in each half if a film has more: whole rows of blocks, unless these are long.
    pub most_slots: u32,
}

/// Times as many slots as fit that a row of blocks may have for the buffers to have room for it.
const LONG_ROW: u64 = 4;

impl Passage {
    /// Bytes of either buffer, for films that are large and not wide, unless others are asked for.
    const BYTES: u32 = 16 << 20;

    /// For a film in bands of up to so many slots, by buffers of about so many bytes.
    fn new(device: &Arc<Device>, film: &Shape, band_slots: u64, bytes: u32) -> Result<Self, RenderError> {
        let fit = (u64::from(bytes) / 2 / size_of::<FilmSlot>() as u64).min(band_slots);
        // Whole rows of blocks are handed out to pixels faster: rather larger buffers than parts of a row.
        let fits = film.row_slots <= LONG_ROW * fit && film.row_slots <= band_slots;
        let unit = if fits { film.row_slots } else { u64::from(SET_SLOTS) };
        let most_slots = (fit / unit * unit).max(unit);
        let halves = if most_slots < film.slots { 2 } else { 1 };
        let bytes = halves * most_slots * size_of::<FilmSlot>() as u64;
        Ok(Self {
            to_device: Buffer::new(device, "to the film", bytes, Usage::Upload)?,
            from_device: Buffer::new(device, "from the film", bytes, Usage::Readback)?,
            most_slots: most_slots as u32,
        })
    }
}

/// All buffers of an engine.
pub(crate) struct Buffers {
    pub bands: Vec<Band>,
    pub passage: Option<Passage>,
    pub counters: Buffer,
    /// Copies of the counters, for each submission in flight.
    pub readbacks: Vec<Buffer>,
    /// Which regions of what the queue's paths note are taken.
    pub queue_pool: Buffer,
    /// What the queue's paths note, or several invocations of a pixel.
    _paths: Buffer,
    pub tables: TableBuffers,
}

impl Buffers {
    /// Makes them all and fills the tables.
    ///
    /// # Errors
    /// A limit of the device or its memory is exceeded.
    pub fn new(
        device: &Arc<Device>,
        layout: &Arc<BindingLayout>,
        timeline: &mut Timeline,
        tables: &Tables,
        sobol: &[Texel],
        shape: &Shape,
    ) -> Result<Self, RenderError> {
        let tables = TableBuffers::new(device, timeline, tables, sobol)?;
        let counters = Buffer::new(device, "counters", size_of::<Counters>() as u64, Usage::Storage)?;
        let readbacks = (0..IN_FLIGHT)
            .map(|i| Buffer::new(device, &format!("readback {i}"), size_of::<Counters>() as u64, Usage::Readback))
            .collect::<Result<Vec<_>, _>>()?;
        let queue_pool = Buffer::new(device, "queue pool", u64::from(shape.regions / 8), Usage::Storage)?;
        // Rows follow each other; only reuse needs more than the first, the paths' light.
        let rows = if shape.records { queue::PATH_ROWS } else { 1 };
        let path_bytes = 16 * u64::from(rows) * u64::from(shape.regions) * u64::from(queue::PATHS);
        let path_bytes = path_bytes.max(16 * shape.split_samples);
        let paths = Buffer::new(device, "paths", path_bytes, Usage::StorageTexelAndArray)?;
        // Nothing is counted, and none of these samples is there.
        let ticket = timeline.submit(|r| {
            r.clear(&counters);
            if shape.split_samples > 0 {
                r.clear(&paths);
            }
            r.barrier(Access::Transfer, Access::Compute);
        })?;
        timeline.wait(&ticket)?;

        // What a binding holds, and a dispatch covers.
        let texels = size_of::<FilmSlot>() as u64 / 16;
        let band_slots = (device.info.max_texel_elements / texels).min(shape.covered).min(MOST_BAND_SLOTS);
        let unit = if band_slots < shape.row_slots { u64::from(SET_SLOTS) } else { shape.row_slots };
        let band_slots = band_slots / unit * unit;
        let mut bands = Vec::new();
        let mut first = 0u64;
        while first < shape.slots {
            let count = (shape.slots - first).min(band_slots);
            let film = Buffer::new(device, "film", count * size_of::<FilmSlot>() as u64, Usage::StorageTexelAndArray)?;
            let gradients = if shape.reuse { count * size_of::<GradientSlot>() as u64 } else { 0 };
            let gradients = Buffer::new(device, "gradients", gradients, Usage::StorageTexelAndArray)?;
            let bound = tables.and(&[
                (binding::FILM, &film),
                (binding::FILM_ROWS, &film),
                (binding::COUNTERS, &counters),
                (binding::PATHS, &paths),
                (binding::QUEUE_POOL, &queue_pool),
                (binding::PATH_TEXELS, &paths),
                (binding::GRADIENTS, &gradients),
                (binding::GRADIENT_ROWS, &gradients),
            ]);
            let set = BindingSet::new(layout, &bound)?;
            bands.push(Band { first: first as u32, slots: count as u32, set, film, gradients });
            first += count;
        }
        let largest = bands.iter().map(|band| u64::from(band.slots)).max().unwrap_or(0);
        let is_mapped = bands.iter().all(|band| band.film.mapped().is_some());
        let passage = match shape.passage {
            None if is_mapped => None,
            bytes => Some(Passage::new(device, shape, largest, bytes.unwrap_or(Passage::BYTES))?),
        };
        Ok(Self { bands, passage, counters, readbacks, queue_pool, _paths: paths, tables })
    }

    /// Makes the system hand out the film's memory, where the host reads it in its place. The driver has no part in it.
    pub fn touch(&mut self) {
        for band in &mut self.bands {
            band.film.touch();
            band.gradients.touch();
        }
    }
}

/// The bytes of a buffer that the host reads.
pub(crate) fn mapped(buffer: &Buffer) -> Result<&[u8], RenderError> {
    buffer.mapped().ok_or_else(unmapped)
}

/// Why there are none.
pub(crate) fn unmapped() -> RenderError {
    RenderError::Driver("it does not map memory that the host reads or writes".to_owned())
}
