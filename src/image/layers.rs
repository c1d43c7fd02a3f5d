//! Layers of numbers beside a picture, such as normals and depths (arbitrary output variables), as one OpenEXR file.

use std::path::Path;

use crate::files;
use crate::image::buffer::{check_count, check_size};
use crate::image::codec;
use crate::image::{ImageError, Metadata};

/// Numbers of all pixels, row by row from the top left.
#[derive(Debug, Clone, PartialEq)]
pub enum LayerValues {
    /// 32-bit floats.
    Float(Vec<f32>),
    /// 32-bit integers, such as ids.
    Integer(Vec<u32>),
}

/// Channels by name, all of the same size; those of a layer are named `layer.channel`.
#[derive(Debug, Clone, PartialEq)]
pub struct ImageLayers {
    width: u32,
    height: u32,
    channels: Vec<(String, LayerValues)>,
}

impl ImageLayers {
    /// No layers yet.
    ///
    /// # Errors
    /// [`ImageError::Size`] as for [`Image::new`](crate::Image::new).
    pub fn new(width: u32, height: u32) -> Result<Self, ImageError> {
        check_size(width, height)?;
        Ok(Self { width, height, channels: Vec::new() })
    }

    /// Adds a channel.
    ///
    /// # Errors
    /// [`ImageError::Count`] unless there is one value for each pixel.
    pub fn push(&mut self, name: impl Into<String>, values: LayerValues) -> Result<(), ImageError> {
        let count = match &values {
            LayerValues::Float(values) => values.len(),
            LayerValues::Integer(values) => values.len(),
        };
        check_count("values of a channel", self.width, self.height, count)?;
        self.channels.push((name.into(), values));
        Ok(())
    }

    /// Adds the three channels of a layer: one for each letter.
    ///
    /// # Errors
    /// As of [`Self::push`].
    pub fn push_vectors(&mut self, layer: &str, letters: &str, values: &[[f32; 3]]) -> Result<(), ImageError> {
        for (axis, letter) in letters.chars().take(3).enumerate() {
            let values = values.iter().map(|value| value[axis]).collect();
            self.push(format!("{layer}.{letter}"), LayerValues::Float(values))?;
        }
        Ok(())
    }

    /// Pixels in a row, and rows.
    pub fn size(&self) -> [u32; 2] {
        [self.width, self.height]
    }

    /// The channels in the order in which they were added.
    pub fn channels(&self) -> &[(String, LayerValues)] {
        &self.channels
    }
}

/// Writes layers as OpenEXR, whole or not at all.
///
/// # Errors
/// [`ImageError::Metadata`] or [`ImageError::Write`]; an older file at `path` is then as it was.
pub fn write_layers(path: &Path, layers: &ImageLayers, metadata: &Metadata) -> Result<(), ImageError> {
    metadata.check()?;
    files::write_whole(path, |writer| codec::encode_layers(layers, metadata, writer))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::exr::prelude::{FlatSamples, read_all_flat_layers_from_file};

    #[test]
    fn layers_are_channels_of_one_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("layers.exr");
        let mut layers = ImageLayers::new(2, 1).unwrap();
        layers.push_vectors("normal", "XYZ", &[[0.0, 1.0, 2.0], [3.0, 4.0, f32::INFINITY]]).unwrap();
        layers.push("id.material", LayerValues::Integer(vec![7, u32::MAX])).unwrap();
        assert!(matches!(layers.push("short", LayerValues::Float(vec![1.0])), Err(ImageError::Count { .. })));
        let mut metadata = Metadata::new();
        metadata.push("Seed", 3);
        write_layers(&path, &layers, &metadata).unwrap();
        let file = read_all_flat_layers_from_file(&path).unwrap();
        let channels = &file.layer_data[0].channel_data.list;
        let names: Vec<_> = channels.iter().map(|channel| channel.name.to_string()).collect();
        assert_eq!(names, ["id.material", "normal.X", "normal.Y", "normal.Z"]);
        assert_eq!(channels[0].sample_data, FlatSamples::U32(vec![7, u32::MAX]));
        assert_eq!(channels[3].sample_data, FlatSamples::F32(vec![2.0, f32::INFINITY]));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
