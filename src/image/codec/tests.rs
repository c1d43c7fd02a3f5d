//! Round trips, foreign files and damaged files of every format.

use std::io::Cursor;

mod damaged;

use crate::image::Variance;
use crate::image::codec::*;

/// A pixel-wise hash in 0..1, so that compression has something to do.
fn noise(x: u32, y: u32, channel: u32) -> f32 {
    let mut h = x.wrapping_mul(0x9E37_79B1) ^ y.wrapping_mul(0x85EB_CA77) ^ channel.wrapping_mul(0xC2B2_AE3D);
    h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D);
    h = (h ^ (h >> 12)).wrapping_mul(0x297A_2D39);
    (h ^ (h >> 15)) as f32 / 4_294_967_296.0
}

fn sample_image(width: u32, height: u32) -> Image {
    // Runs of equal pixels, noise, and a range of magnitudes.
    Image::from_fn(width, height, |x, y| {
        if x % 40 < 15 {
            [0.25, 0.5, 2.0]
        } else {
            let scale = 2f32.powi((y % 60) as i32 - 30);
            [0, 1, 2].map(|c| scale * noise(x, y, c))
        }
    })
    .unwrap()
}

fn sample_metadata() -> Metadata {
    let mut metadata = Metadata::new();
    metadata.push("device", "llvmpipe (LLVM 15.0.6, 256 bits)");
    metadata.push("settings", "two\nlines \\n and a return\r: 2.0 # é µ");
    metadata.push("seed", u64::MAX);
    metadata.push("a-key_of.the-greatest-length-that-a-name-of-an-entry-may-have.64", "");
    metadata
}

fn encoded(format: Format, image: &Image, metadata: &Metadata, transfer: Transfer) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    encode(format, image, metadata, transfer, &mut bytes).unwrap();
    bytes.into_inner()
}

fn bits(pixels: &[[f32; 3]]) -> Vec<u32> {
    pixels.as_flattened().iter().map(|v| v.to_bits()).collect()
}

#[test]
fn float_formats_keep_every_bit() {
    let special = [0.0, -0.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e-42, f32::MAX, -1.5, 1.0 / 3.0];
    for (width, height) in [(1, 1), (3, 3), (70, 41)] {
        let image = Image::from_fn(width, height, |x, y| {
            [0, 1, 2].map(|c| {
                special[(x * 3 + y * 7 + c) as usize % special.len()] * if x > 9 { noise(x, y, c) } else { 1.0 }
            })
        })
        .unwrap();
        for format in [Format::Exr, Format::Pfm] {
            let bytes = encoded(format, &image, &Metadata::new(), Transfer::Srgb);
            let (read, metadata) = decode(format, &bytes).unwrap();
            assert_eq!((read.width(), read.height()), (width, height));
            assert_eq!(bits(read.pixels()), bits(image.pixels()), "{format}");
            assert_eq!(metadata, Metadata::new());
        }
    }
}

#[test]
fn exr_keeps_the_variance() {
    let of_mean = sample_image(33, 20).pixels().to_vec();
    let variance = Variance { of_mean, batches: 17 };
    let image = sample_image(33, 20).with_variance(variance).unwrap();
    let bytes = encoded(Format::Exr, &image, &sample_metadata(), Transfer::Srgb);
    let (read, metadata) = decode(Format::Exr, &bytes).unwrap();
    assert_eq!(read, image);
    assert_eq!(metadata.iter().count(), sample_metadata().iter().count());
}

#[test]
fn metadata_is_found_again() {
    for format in [Format::Png, Format::Hdr, Format::Exr] {
        let bytes = encoded(format, &sample_image(9, 5), &sample_metadata(), Transfer::Srgb);
        let (_, metadata) = decode(format, &bytes).unwrap();
        let sorted = |m: &Metadata| {
            let mut entries: Vec<_> = m.iter().map(|(k, v)| (k.to_owned(), v.to_owned())).collect();
            entries.sort();
            entries
        };
        assert_eq!(sorted(&metadata), sorted(&sample_metadata()), "{format}");
    }
}

#[test]
fn equal_images_make_equal_files() {
    for format in Format::ALL {
        let make = || encoded(format, &sample_image(50, 30), &sample_metadata(), Transfer::Srgb);
        let first = make();
        // A hash map's order differs from map to map.
        assert!((0..8).all(|_| make() == first), "{format}");
    }
}

#[test]
fn png_is_within_half_a_code() {
    let image = Image::from_fn(64, 32, |x, y| [0, 1, 2].map(|c| noise(x, y, c).powi(2))).unwrap();
    for transfer in [Transfer::Gamma(2.2), Transfer::Gamma(1.0), Transfer::Gamma(1.8), Transfer::Srgb] {
        let bytes = encoded(Format::Png, &image, &Metadata::new(), transfer);
        let (read, _) = decode(Format::Png, &bytes).unwrap();
        for (a, b) in read.pixels().as_flattened().iter().zip(image.pixels().as_flattened()) {
            let codes = [a, b].map(|v| 255.0 * transfer.encode(f64::from(*v)));
            assert!((codes[0] - codes[1]).abs() <= 0.5 + 1e-4, "{transfer:?}: {a} for {b}");
        }
        // Once quantized, it is a fixed point: the transfer was found again in the file.
        assert_eq!(encoded(Format::Png, &read, &Metadata::new(), transfer), bytes);
    }
}

#[test]
fn png_holds_the_codes_and_chunks() {
    let image = Image::from_pixels(2, 1, vec![[0.0, 0.5, 1.0], [f32::NAN, f32::INFINITY, -3.0]]).unwrap();
    let gamma = encoded(Format::Png, &image, &Metadata::new(), Transfer::Gamma(2.2));
    let oracle = ::image::load_from_memory(&gamma).unwrap().into_rgb8();
    assert_eq!(oracle.as_raw(), &[0, 186, 255, 0, 255, 0]);
    let position = |bytes: &[u8], chunk: &[u8]| bytes.windows(chunk.len()).position(|w| w == chunk);
    let gama = position(&gamma, b"gAMA").unwrap();
    assert_eq!(gamma[gama + 4..gama + 8], 45_455u32.to_be_bytes());
    assert_eq!(position(&gamma, b"sRGB"), None);
    let srgb = encoded(Format::Png, &image, &Metadata::new(), Transfer::Srgb);
    assert!(position(&srgb, b"sRGB").is_some());
    assert_eq!(::image::load_from_memory(&srgb).unwrap().into_rgb8().as_raw(), &[0, 188, 255, 0, 255, 0]);
}

#[test]
fn png_of_other_kinds() {
    use ::png::{BitDepth, ColorType, Encoder};
    let make = |color, depth, data: &[u8], palette: Option<&[u8]>| {
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(&mut bytes, 2, 1);
        encoder.set_color(color);
        encoder.set_depth(depth);
        if let Some(palette) = palette {
            encoder.set_palette(palette.to_vec());
        }
        encoder.write_header().unwrap().write_image_data(data).unwrap();
        decode(Format::Png, &bytes).unwrap().0.pixels().to_vec()
    };
    // sRGB, as there is no chunk; 188 decodes to 0.50289.
    let mid = ((188.0f64 / 255.0 + 0.055) / 1.055).powf(2.4) as f32;
    assert_eq!(make(ColorType::Grayscale, BitDepth::Eight, &[188, 255], None), [[mid; 3], [1.0; 3]]);
    assert_eq!(make(ColorType::Grayscale, BitDepth::One, &[0b0100_0000], None), [[0.0; 3], [1.0; 3]]);
    assert_eq!(make(ColorType::GrayscaleAlpha, BitDepth::Eight, &[188, 0, 255, 9], None), [[mid; 3], [1.0; 3]]);
    assert_eq!(
        make(ColorType::Rgba, BitDepth::Eight, &[188, 0, 255, 0, 255, 188, 0, 255], None),
        [[mid, 0.0, 1.0], [1.0, mid, 0.0]]
    );
    assert_eq!(
        make(ColorType::Indexed, BitDepth::One, &[0b1000_0000], Some(&[188, 0, 0, 0, 0, 255])),
        [[0.0, 0.0, 1.0], [mid, 0.0, 0.0]]
    );
    let sixteen = make(ColorType::Rgb, BitDepth::Sixteen, &[0x80, 0, 0xFF, 0xFF, 0, 0, 0, 1, 0, 2, 0, 3], None);
    let expected = ((32_768.0f64 / 65_535.0 + 0.055) / 1.055).powf(2.4) as f32;
    assert_eq!(sixteen[0], [expected, 1.0, 0.0]);
    assert!((sixteen[1][2] - 3.0 / 65_535.0 / 12.92).abs() < 1e-9);
}

#[test]
fn hdr_is_within_half_a_mantissa_step() {
    // Widths below and within those that are run-length coded; the largest mantissa is 128..=255.
    for (width, height) in [(3, 61), (200, 61)] {
        let image = sample_image(width, height);
        let bytes = encoded(Format::Hdr, &image, &Metadata::new(), Transfer::Srgb);
        let (read, _) = decode(Format::Hdr, &bytes).unwrap();
        let mut mean = 0.0;
        for (a, b) in read.pixels().iter().zip(image.pixels()) {
            let largest = b.iter().fold(0.0f32, |m, v| m.max(*v));
            for c in 0..3 {
                assert!((a[c] - b[c]).abs() <= largest / 255.0, "{a:?} for {b:?}");
                mean += (a[c] - b[c]) / largest.max(f32::MIN_POSITIVE);
            }
        }
        assert!((mean / (width * height * 3) as f32).abs() < 2e-4, "rounding is biased: {mean}");
    }
}

#[test]
fn hdr_holds_the_codes() {
    // By hand: 1 = 128·2^(129-136), 0.3 = 153.6·2^(127-136), 0.003 = 196.6·2^(120-136).
    let row = [[1.0, 0.5, 0.0], [0.3, 0.1, 0.0], [0.003, -1.0, 0.0029]];
    let codes = [[128, 64, 0, 129], [154, 51, 0, 127], [197, 0, 190, 120]];
    let image = Image::from_fn(3, 2, |x, y| if y == 0 { row[x as usize] } else { [0.0; 3] }).unwrap();
    let bytes = encoded(Format::Hdr, &image, &Metadata::new(), Transfer::Srgb);
    let header = bytes.len() - 24;
    assert!(bytes[..header].starts_with(b"#?RADIANCE\n") && bytes[..header].ends_with(b"\n\n-Y 2 +X 3\n"));
    assert_eq!(bytes[header..header + 12], *codes.as_flattened());
    assert_eq!(bytes[header + 12..], [0; 12]);
    // Run-length coded: each component by itself, 128 + 9 for a run.
    let image = Image::from_fn(9, 1, |_, _| row[1]).unwrap();
    let bytes = encoded(Format::Hdr, &image, &Metadata::new(), Transfer::Srgb);
    assert!(bytes.ends_with(&[2, 2, 0, 9, 137, 154, 137, 51, 137, 0, 137, 127]));
}

#[test]
fn hdr_extremes() {
    for (value, expected) in [
        ([0.0; 3], [0.0; 3]),
        ([1.0, 0.5, 0.0], [1.0, 0.5, 0.0]),
        ([-1.0, 2.0, f32::NAN], [0.0, 2.0, 0.0]),
        ([0.999_999, 0.0, 0.0], [1.0, 0.0, 0.0]), // rounds up into the next exponent
        ([f32::INFINITY, 0.0, 0.0], [255.0 * 2f32.powi(119), 0.0, 0.0]),
        ([f32::MAX, 0.0, 0.0], [255.0 * 2f32.powi(119), 0.0, 0.0]),
        ([1e-42, 0.0, 0.0], [0.0; 3]),
        ([2f32.powi(-128), 0.0, 0.0], [2f32.powi(-128), 0.0, 0.0]), // the smallest with a full mantissa
    ] {
        let image = Image::from_pixels(1, 1, vec![value]).unwrap();
        let bytes = encoded(Format::Hdr, &image, &Metadata::new(), Transfer::Srgb);
        assert_eq!(decode(Format::Hdr, &bytes).unwrap().0.pixels(), [expected], "{value:?}");
    }
}

#[test]
fn hdr_from_others() {
    // New run-length code: runs of 8 red, then 1 and 7 green, 8 blue one by one, 8 of the exponent.
    let mut new = b"#?RADIANCE\n\n-Y 1 +X 8\n\x02\x02\0\x08".to_vec();
    new.extend([136, 128, 1, 0, 135, 64, 8, 0, 1, 2, 3, 4, 5, 6, 7, 136, 129]);
    let (read, _) = decode(Format::Hdr, &new).unwrap();
    let expected = [0, 1, 2, 3, 4, 5, 6, 7].map(|x| [1.0, if x == 0 { 0.0 } else { 0.5 }, x as f32 / 128.0]);
    assert_eq!(read.pixels(), expected);
    // Old run-length code: a pixel, then (1,1,1,2), (1,1,1,1): 2 + 256 more; and two exposures.
    let mut old = b"#?RGBE\nEXPOSURE=2\r\nGAMMA=1\nEXPOSURE= 0.25\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 260\n".to_vec();
    old.extend([128, 64, 0, 129, 1, 1, 1, 2, 1, 1, 1, 1, 0, 0, 128, 129]);
    let (read, _) = decode(Format::Hdr, &old).unwrap();
    assert_eq!(read.pixels()[..259], vec![[2.0, 1.0, 0.0]; 259]);
    assert_eq!(read.pixels()[259], [0.0, 0.0, 2.0]);
}

#[test]
fn pfm_from_others() {
    let colour = |order: fn(f32) -> [u8; 4], scale: &str| {
        let mut bytes = format!("PF\n1 2\n{scale}\n").into_bytes();
        bytes.extend([1.0, 2.0, 3.0, 4.0, 5.0, 6.0].into_iter().flat_map(order));
        decode(Format::Pfm, &bytes).unwrap().0.pixels().to_vec()
    };
    let top_down = [[4.0, 5.0, 6.0], [1.0, 2.0, 3.0]];
    assert_eq!(colour(f32::to_le_bytes, "-1.0"), top_down);
    assert_eq!(colour(f32::to_be_bytes, "1"), top_down);
    assert_eq!(colour(f32::to_be_bytes, "2.0"), top_down.map(|p| p.map(|v| 2.0 * v)));
    let mut grey = b"Pf 2 1 -1\n".to_vec();
    grey.extend([0.25f32, 7.0].into_iter().flat_map(f32::to_le_bytes));
    assert_eq!(decode(Format::Pfm, &grey).unwrap().0.pixels(), [[0.25; 3], [7.0; 3]]);
}

mod exr_from_others {
    use super::*;
    use ::exr::prelude::*;

    fn file(layers: Vec<Vec<AnyChannel<FlatSamples>>>) -> Vec<u8> {
        let layers: Layers<_> = layers
            .into_iter()
            .enumerate()
            .map(|(i, channels)| {
                let attributes = LayerAttributes::named(format!("part {i}").as_str());
                Layer::new((2, 1), attributes, Encoding::FAST_LOSSLESS, AnyChannels::sort(channels.into()))
            })
            .collect();
        let attributes = ImageAttributes::new(IntegerBounds::from_dimensions((2, 1)));
        let mut bytes = Cursor::new(Vec::new());
        ::exr::image::Image { attributes, layer_data: layers }.write().to_buffered(&mut bytes).unwrap();
        bytes.into_inner()
    }

    fn half(name: &str, values: [f32; 2]) -> AnyChannel<FlatSamples> {
        AnyChannel::new(name, FlatSamples::F16(values.iter().map(|v| f16::from_f32(*v)).collect()))
    }

    fn full(name: &str, values: [f32; 2]) -> AnyChannel<FlatSamples> {
        AnyChannel::new(name, FlatSamples::F32(values.to_vec()))
    }

    #[test]
    fn half_and_mixed_and_named_layers() {
        let pixels = |bytes: &[u8]| decode(Format::Exr, bytes).unwrap().0.pixels().to_vec();
        let expected = [[0.5, 2.0, -1.0], [0.25, 0.1, 65504.0]];
        let mixed = |p: &str| {
            vec![
                half(&format!("{p}R"), [0.5, 0.25]),
                full(&format!("{p}G"), [2.0, 0.1]),
                half(&format!("{p}B"), [-1.0, 65504.0]),
                half(&format!("{p}A"), [1.0, 1.0]),
            ]
        };
        assert_eq!(pixels(&file(vec![mixed("")])), expected);
        assert_eq!(pixels(&file(vec![mixed("beauty.")])), expected);
        // A part without colour first, and a depth channel beside the colour.
        let mut second = mixed("");
        second.push(full("Z", [3.0, 4.0]));
        assert_eq!(pixels(&file(vec![vec![full("Z", [1.0, 2.0])], second])), expected);
        // A variance without our attribute says nothing of its batches: not taken.
        let mut variance = mixed("");
        variance.extend(["R", "G", "B"].map(|c| full(&format!("variance.{c}"), [1.0, 1.0])));
        let (image, _) = decode(Format::Exr, &file(vec![variance])).unwrap();
        assert_eq!((image.pixels(), image.variance()), (&expected[..], None));
    }

    #[test]
    fn what_is_no_colour_is_refused_by_name() {
        let refused = |channels| match decode(Format::Exr, &file(vec![channels])) {
            Err(DecodeError::Unsupported(problem)) => problem,
            other => panic!("{other:?}"),
        };
        assert!(refused(vec![full("Y", [1.0, 1.0]), full("Z", [1.0, 1.0])]).contains("Y, Z"));
        let integers = |name: &str| AnyChannel::new(name, FlatSamples::U32(vec![1, 2]));
        assert!(refused(vec![integers("R"), integers("G"), integers("B")]).contains("integers"));
    }
}
