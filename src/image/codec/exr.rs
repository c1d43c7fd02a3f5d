//! OpenEXR: 32-bit float, ZIP compressed, with the noise estimate as the layer `variance` and the numbers of samples
//! as the 32-bit integer channel `samples`.

use std::io::{self, Cursor, Write};

use ::exr::block;
use ::exr::error::Error;
use ::exr::meta::attribute::{AttributeValue, Text};
use ::exr::meta::header::LayerAttributes;
use ::exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image as ExrImage, Layer, ReadChannels, ReadLayers, Vec2,
    WritableImage, read,
};
use smallvec::SmallVec;

use crate::image::codec::{DecodeError, check_header};
use crate::image::{Image, ImageLayers, LayerValues, Metadata, Variance};

/// Attributes of the header that hold metadata: this, then the key.
const PREFIX: &str = "photolith.";
/// The attribute that holds [`Variance::batches`].
const BATCHES: &str = "photolith.variance.batches";
/// The channel that holds the number of samples of each pixel.
const COUNTS: &str = "samples";
const COLOR: [&str; 3] = ["R", "G", "B"];
const VARIANCE: [&str; 3] = ["variance.R", "variance.G", "variance.B"];

/// Writes channels R, G, B and, where known, variance.R, variance.G, variance.B, samples and A.
pub(super) fn encode(image: &Image, metadata: &Metadata, writer: &mut impl Write) -> io::Result<()> {
    let mut channels = SmallVec::new();
    let mut add = |names: [&str; 3], values: &[[f32; 3]]| {
        for (c, name) in names.into_iter().enumerate() {
            channels.push(AnyChannel::new(name, FlatSamples::F32(values.iter().map(|v| v[c]).collect())));
        }
    };
    add(COLOR, image.pixels());
    let mut attributes = LayerAttributes::default();
    if let Some(variance) = image.variance() {
        add(VARIANCE, &variance.of_mean);
        attributes.other.insert(text(BATCHES), AttributeValue::Text(text(&variance.batches.to_string())));
    }
    if let Some(counts) = image.counts() {
        channels.push(AnyChannel::new(COUNTS, FlatSamples::U32(counts.to_vec())));
    }
    if let Some(alpha) = image.alpha() {
        channels.push(AnyChannel::new("A", FlatSamples::F32(alpha.to_vec())));
    }
    write([image.width(), image.height()], channels, attributes, metadata, writer)
}

/// Writes the channels of layers, in one part.
pub(super) fn encode_layers(layers: &ImageLayers, metadata: &Metadata, writer: &mut impl Write) -> io::Result<()> {
    let channel = |(name, values): &(String, LayerValues)| {
        let values = match values {
            LayerValues::Float(values) => FlatSamples::F32(values.clone()),
            LayerValues::Integer(values) => FlatSamples::U32(values.clone()),
        };
        AnyChannel::new(text(name), values)
    };
    let channels = layers.channels().iter().map(channel).collect();
    write(layers.size(), channels, LayerAttributes::default(), metadata, writer)
}

fn write(
    [width, height]: [u32; 2],
    channels: SmallVec<[AnyChannel<FlatSamples>; 4]>,
    mut attributes: LayerAttributes,
    metadata: &Metadata,
    writer: &mut impl Write,
) -> io::Result<()> {
    for (key, value) in metadata.iter() {
        attributes.other.insert(text(&format!("{PREFIX}{key}")), AttributeValue::Text(text(value)));
    }
    let size = Vec2(width as usize, height as usize);
    let layer = Layer::new(size, attributes, Encoding::SMALL_LOSSLESS, AnyChannels::sort(channels));
    let mut bytes = Vec::new();
    ExrImage::from_layer(layer).write().to_buffered(Cursor::new(&mut bytes)).map_err(io_error)?;
    let (head, pixels) = sort_attributes(&bytes).ok_or_else(|| io::Error::other("the encoder's header is damaged"))?;
    writer.write_all(&head)?;
    writer.write_all(pixels)
}

/// UTF-8, which OpenEXR uses by convention; [`Text`] itself would take Latin-1 only.
fn text(value: &str) -> Text {
    Text::from_bytes_unchecked(SmallVec::from_slice(value.as_bytes()))
}

fn io_error(error: Error) -> io::Error {
    match error {
        Error::Io(error) => error,
        other => io::Error::other(other.to_string()),
    }
}

/// Splits a one-part file into its header, with the attributes sorted by name, and the rest.
///
/// The encoder keeps attributes in a hash map: without this, equal images would make unequal files.
/// The length does not change, so that the offsets in the rest stay right.
fn sort_attributes(bytes: &[u8]) -> Option<(Vec<u8>, &[u8])> {
    let (magic_and_version, mut rest) = bytes.split_at_checked(8)?;
    let mut attributes = Vec::new();
    // An attribute is name, NUL, type, NUL, length (i32), value; an empty name ends the list.
    while *rest.first()? != 0 {
        let name = rest.iter().position(|&b| b == 0)?;
        let kind = rest.get(name + 1..)?.iter().position(|&b| b == 0)?;
        let value = name + kind + 2;
        let length = u32::from_le_bytes(*rest.get(value..)?.first_chunk()?) as usize;
        let (attribute, after) = rest.split_at_checked(value + 4 + length)?;
        attributes.push((&attribute[..name], attribute));
        rest = after;
    }
    attributes.sort_unstable();
    let sorted = attributes.iter().flat_map(|(_, attribute)| attribute.iter());
    Some((magic_and_version.iter().chain(sorted).copied().collect(), rest))
}

/// Reads the first part with channels R, G, B (or those of its first layer that has them) in 16- or 32-bit float.
pub(super) fn decode(bytes: &[u8]) -> Result<(Image, Metadata), DecodeError> {
    let chunks = block::read(Cursor::new(bytes), false).map_err(decode_error)?;
    for header in chunks.headers() {
        // ZIP reaches 1032:1 and a pixel has at least two bytes.
        check_header(header.layer_size.0 as u64, header.layer_size.1 as u64, bytes.len(), 1032)?;
    }
    let file = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .non_parallel()
        .from_chunks(chunks)
        .map_err(decode_error)?;
    let found = file.layer_data.iter().find_map(|layer| Some((layer, color_prefix(layer)?)));
    let Some((layer, prefix)) = found else {
        let names: Vec<_> =
            file.layer_data.iter().flat_map(|l| &l.channel_data.list).map(|c| c.name.to_string()).collect();
        return Err(DecodeError::Unsupported(format!(
            "the channels are {}, expected R, G and B among them",
            names.join(", ")
        )));
    };
    // The sizes were checked with the headers.
    let (width, height) = (layer.size.0 as u32, layer.size.1 as u32);
    let mut image = Image::from_pixels(width, height, triple(layer, &COLOR.map(|c| format!("{prefix}{c}")))?)?;
    // Other programs' channels of that name may hold something else.
    if let Some(FlatSamples::U32(counts)) = channel(layer, COUNTS).map(|c| &c.sample_data)
        && counts.len() == image.pixels().len()
    {
        image = image.with_counts(counts.clone())?;
    }

    let mut metadata = Metadata::new();
    let mut batches = None;
    let mut attributes: Vec<_> = layer.attributes.other.iter().collect();
    attributes.sort_unstable_by_key(|(name, _)| name.as_slice());
    for (name, value) in attributes {
        let AttributeValue::Text(value) = value else { continue };
        let (name, value) = (String::from_utf8_lossy(name.as_slice()), String::from_utf8_lossy(value.as_slice()));
        if name == BATCHES {
            batches = value.parse().ok();
        } else if let Some(key) = name.strip_prefix(PREFIX) {
            metadata.push(key, value);
        }
    }
    let has_variance = VARIANCE.iter().all(|name| channel(layer, name).is_some());
    match batches.filter(|_| has_variance) {
        Some(batches) => {
            let of_mean = triple(layer, &VARIANCE.map(String::from))?;
            Ok((image.with_variance(Variance { of_mean, batches })?, metadata))
        }
        None => Ok((image, metadata)),
    }
}

fn decode_error(error: Error) -> DecodeError {
    match error {
        Error::NotSupported(problem) => DecodeError::Unsupported(problem.into_owned()),
        other => DecodeError::malformed(other),
    }
}

type FlatLayer = Layer<AnyChannels<FlatSamples>>;

/// What comes before R, G and B in the names of the layer's first complete set other than a variance.
fn color_prefix(layer: &FlatLayer) -> Option<String> {
    let names = || layer.channel_data.list.iter().map(|c| c.name.to_string());
    let mut prefixes: Vec<_> = names()
        .filter_map(|name| name.strip_suffix('R').map(String::from))
        .filter(|prefix| prefix.is_empty() || prefix.ends_with('.') && prefix != "variance.")
        .filter(|prefix| ["G", "B"].iter().all(|c| names().any(|name| name == format!("{prefix}{c}"))))
        .collect();
    prefixes.sort();
    prefixes.into_iter().next()
}

fn channel<'a>(layer: &'a FlatLayer, name: &str) -> Option<&'a AnyChannel<FlatSamples>> {
    layer.channel_data.list.iter().find(|c| c.name.as_slice() == name.as_bytes())
}

/// Three channels of the layer, interleaved.
fn triple(layer: &FlatLayer, names: &[String; 3]) -> Result<Vec<[f32; 3]>, DecodeError> {
    let count = layer.size.area();
    let mut values = vec![[0.0; 3]; count];
    for (c, name) in names.iter().enumerate() {
        let channel = channel(layer, name).ok_or_else(|| DecodeError::Malformed(format!("no channel {name}")))?;
        if channel.sampling != Vec2(1, 1) {
            return Err(DecodeError::Unsupported(format!("channel {name} is subsampled")));
        }
        if channel.sample_data.len() != count {
            return Err(DecodeError::Malformed(format!(
                "channel {name} has {} samples, expected {count}",
                channel.sample_data.len()
            )));
        }
        if matches!(channel.sample_data, FlatSamples::U32(_)) {
            return Err(DecodeError::Unsupported(format!("channel {name} holds integers, expected float")));
        }
        for (value, sample) in values.iter_mut().zip(channel.sample_data.values_as_f32()) {
            value[c] = sample;
        }
    }
    Ok(values)
}
