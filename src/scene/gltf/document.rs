//! A glTF file as JSON and bytes: what it needs of extensions, and where its buffers are.

use std::sync::OnceLock;

use gltf::json::{Index, Root};
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

use crate::scene::error::SceneError;
use crate::scene::gltf::meshopt::Compressed;
use crate::scene::gltf::problem::problem;
use crate::scene::gltf::uri;
use crate::scene::read::Files;

/// Extensions that are understood, or that change nothing here.
const UNDERSTOOD: [&str; 21] = [
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "KHR_animation_pointer",
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_texture_transform",
    "KHR_xmp",
    "KHR_xmp_json_ld",
];

/// A file that has been read, with all of its buffers.
pub(super) struct Document<'a> {
    /// For messages.
    pub name: &'a str,
    pub root: Root,
    pub buffers: Vec<Vec<u8>>,
    /// Compressed buffer views that have been decoded.
    decoded_views: Vec<OnceLock<Vec<u8>>>,
    pub files: Files<'a>,
}

impl<'a> Document<'a> {
    /// Reads a `.gltf` or a `.glb`, whichever it is.
    pub fn parse(
        bytes: &[u8],
        name: &'a str,
        files: Files<'a>,
        warnings: &mut Vec<String>,
    ) -> Result<Self, SceneError> {
        let (json, binary) = if bytes.starts_with(MAGIC) { split(bytes, name)? } else { (bytes, None) };
        let json = json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(json);
        let root: Root =
            serde_json::from_slice(json).or_else(|error| without_pointers(json).ok_or(error)).map_err(|error| {
                let at = format!("JSON, line {}, column {}", error.line(), error.column());
                problem(name, at, error, "glTF 2.0")
            })?;
        let decoded_views = root.buffer_views.iter().map(|_| OnceLock::new()).collect();
        let mut document = Self { name, root, buffers: Vec::new(), decoded_views, files };
        document.check_version()?;
        document.check_extensions(warnings)?;
        document.buffers = document.read_buffers(binary)?;
        Ok(document)
    }

    /// An error that names a part of the file.
    pub fn error(&self, at: impl ToString, found: impl ToString, expected: impl ToString) -> SceneError {
        problem(self.name, at, found, expected)
    }

    /// An element of one of the file's lists.
    pub fn get<'b, T>(&self, list: &'b [T], index: usize, what: &str, at: impl ToString) -> Result<&'b T, SceneError> {
        list.get(index).ok_or_else(|| self.error(at, format!("{what} {index}"), format!("one below {}", list.len())))
    }

    /// What an extension says, of those of some part.
    pub fn extension<T: DeserializeOwned>(
        &self,
        extensions: Option<&Map<String, Value>>,
        name: &str,
        at: impl ToString,
    ) -> Result<Option<T>, SceneError> {
        let Some(value) = extensions.and_then(|all| all.get(name)) else { return Ok(None) };
        let parsed = serde_json::from_value(value.clone());
        parsed
            .map(Some)
            .map_err(|error| self.error(format!("{}, {name}", at.to_string()), error, "what the extension defines"))
    }

    fn check_version(&self) -> Result<(), SceneError> {
        let asset = &self.root.asset;
        let version = asset.min_version.as_ref().unwrap_or(&asset.version);
        match version.split('.').next() {
            Some("2") if version.as_str() <= "2.0" || asset.min_version.is_none() => Ok(()),
            _ => Err(self.error("asset", format!("version {version:?}"), "version 2.0")),
        }
    }

    fn check_extensions(&self, warnings: &mut Vec<String>) -> Result<(), SceneError> {
        let is_known = |name: &String| UNDERSTOOD.contains(&name.as_str());
        let required = &self.root.extensions_required;
        if let Some(unknown) = required.iter().find(|name| !is_known(name)) {
            let expected = "no extension that the file cannot be read without but those of docs/gltf.md";
            return Err(self.error("extensionsRequired", unknown, expected));
        }
        let unknown: Vec<_> = self.root.extensions_used.iter().filter(|name| !is_known(name)).cloned().collect();
        if !unknown.is_empty() {
            warnings.push(format!("{}: extensions that are left out: {}", self.name, unknown.join(", ")));
        }
        Ok(())
    }

    fn read_buffers(&self, binary: Option<&[u8]>) -> Result<Vec<Vec<u8>>, SceneError> {
        let read = |(index, buffer): (usize, &gltf::json::Buffer)| {
            let at = || format!("buffer {index}");
            let length = buffer.byte_length.0;
            // Only a fallback for readers that do not know the compression.
            let is_fallback = self.root.extensions_used.iter().any(|name| name.ends_with("_meshopt_compression"));
            let bytes = match (&buffer.uri, binary) {
                (Some(uri), _) => uri::read(self.files, uri, self.name, &at())?,
                (None, Some(binary)) if index == 0 => binary.to_vec(),
                (None, _) if is_fallback => return Ok(Vec::new()),
                (None, _) => {
                    return Err(self.error(
                        at(),
                        "no uri",
                        "a uri, or, for the first buffer of a .glb, a binary chunk",
                    ));
                }
            };
            if (bytes.len() as u64) < length {
                return Err(self.error(
                    at(),
                    format!("{} bytes", bytes.len()),
                    format!("at least {length} (byteLength)"),
                ));
            }
            Ok(bytes)
        };
        self.root.buffers.iter().enumerate().map(read).collect()
    }

    /// Bytes of a buffer view, decoded if they are compressed.
    pub fn view_content(&self, index: usize, at: &str) -> Result<&[u8], SceneError> {
        let Some(compressed) = self.compressed(index, at)? else { return self.plain_view(index, at) };
        // Attributes that alternate in a view are read one after the other: it is decoded for the first.
        let decoded = &self.decoded_views[index];
        match decoded.get() {
            Some(bytes) => Ok(bytes),
            None => {
                let bytes = self.decode(&compressed, index)?;
                Ok(decoded.get_or_init(|| bytes))
            }
        }
    }

    fn decode(&self, compressed: &Compressed, index: usize) -> Result<Vec<u8>, SceneError> {
        let at = format!("bufferView {index}, EXT_meshopt_compression");
        let buffer = self.get(&self.buffers, compressed.buffer, "buffer", &at)?;
        let range = usize::try_from(compressed.byte_offset)
            .ok()
            .and_then(|first| Some(first..first.checked_add(usize::try_from(compressed.byte_length).ok()?)?));
        let data = range
            .and_then(|range| buffer.get(range))
            .ok_or_else(|| self.error(&at, "bytes beyond the end", format!("bytes of a buffer of {}", buffer.len())))?;
        // A byte stands for so many decoded ones at most.
        let most = data.len().saturating_mul(16 * 256);
        if compressed.decoded_length().is_none_or(|length| length > most) {
            return Err(self.error(at, format!("{} elements", compressed.count), "as many as the data can hold"));
        }
        let decoded = compressed.decode(data);
        decoded.ok_or_else(|| self.error(at, "data that cannot be decoded", "data of the extension's format"))
    }

    /// Bytes from one element of a view to the next, where they are not next to each other.
    pub fn stride(&self, index: usize) -> Option<usize> {
        let compressed = self.compressed(index, "").ok().flatten();
        let view = self.root.buffer_views.get(index)?;
        compressed.map(|compressed| compressed.byte_stride).or_else(|| view.byte_stride.map(|stride| stride.0))
    }

    fn compressed(&self, index: usize, at: &str) -> Result<Option<Compressed>, SceneError> {
        let view = self.get(&self.root.buffer_views, index, "bufferView", at)?;
        let extensions = view.extensions.as_ref().map(|extensions| &extensions.others);
        for name in ["EXT_meshopt_compression", "KHR_meshopt_compression"] {
            if let Some(found) = self.extension(extensions, name, format!("bufferView {index}"))? {
                return Ok(Some(found));
            }
        }
        Ok(None)
    }

    /// Bytes of a buffer view.
    fn plain_view(&self, index: usize, at: &str) -> Result<&[u8], SceneError> {
        let view = self.get(&self.root.buffer_views, index, "bufferView", at)?;
        let buffer = self.get(&self.buffers, view.buffer.value(), "buffer", format!("bufferView {index}"))?;
        let first = view.byte_offset.map_or(0, |offset| offset.0);
        let end = first.checked_add(view.byte_length.0).filter(|&end| end <= buffer.len() as u64).ok_or_else(|| {
            let found = format!("bytes {first} and {} more", view.byte_length.0);
            self.error(format!("bufferView {index}"), found, format!("bytes of a buffer of {}", buffer.len()))
        })?;
        Ok(&buffer[first as usize..end as usize])
    }
}

/// The file without channels of animations that move no node (KHR_animation_pointer).
fn without_pointers(json: &[u8]) -> Option<Root> {
    let mut value: Value = serde_json::from_slice(json).ok()?;
    for animation in value.get_mut("animations")?.as_array_mut()? {
        let channels = animation.get_mut("channels")?.as_array_mut()?;
        channels.retain(|channel| channel.pointer("/target/node").is_some());
    }
    serde_json::from_value(value).ok()
}

/// An index into a list, as a number.
pub(super) fn number<T>(index: Index<T>) -> usize {
    index.value()
}

const MAGIC: &[u8] = b"glTF";
const JSON: u32 = 0x4e4f_534a;
const BINARY: u32 = 0x004e_4942;

/// Whether bytes are a `.glb`.
pub(in crate::scene) fn is_glb(bytes: &[u8]) -> bool {
    bytes.starts_with(MAGIC)
}

/// The JSON and the binary chunk of a `.glb`.
fn split<'b>(bytes: &'b [u8], name: &str) -> Result<(&'b [u8], Option<&'b [u8]>), SceneError> {
    let word = |at: usize| bytes.get(at..at + 4).and_then(|word| word.try_into().ok()).map(u32::from_le_bytes);
    if word(4) != Some(2) {
        let found = word(4).map_or("nothing".to_owned(), |version| format!("version {version}"));
        return Err(problem(name, "GLB header", found, "version 2"));
    }
    let (mut json, mut binary) = (None, None);
    let mut at = 12;
    while let (Some(length), Some(kind)) = (word(at), word(at + 4)) {
        let Some(chunk) = bytes.get(at + 8..).and_then(|rest| rest.get(..length as usize)) else {
            let found = format!("a chunk of {length} bytes, of which {} are there", bytes.len().saturating_sub(at + 8));
            return Err(problem(name, format!("GLB, byte {at}"), found, "a whole file"));
        };
        match kind {
            JSON if json.is_none() => json = Some(chunk),
            BINARY if binary.is_none() => binary = Some(chunk),
            _ => {}
        }
        at = (at + 8 + length as usize).next_multiple_of(4);
    }
    let json = json.ok_or_else(|| problem(name, "GLB", "no chunk of JSON", "one"))?;
    Ok((json, binary))
}
