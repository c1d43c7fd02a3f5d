//! Damaged files: refused with the reason, without panic and without much memory.

use crate::image::codec::tests::*;

#[test]
fn damaged_headers_are_refused_with_the_reason() {
    let png = encoded(Format::Png, &sample_image(9, 5), &Metadata::new(), Transfer::Srgb);
    let exr = encoded(Format::Exr, &sample_image(9, 5), &Metadata::new(), Transfer::Srgb);
    let huge_png = {
        let mut bytes = png.clone();
        bytes[16..24].copy_from_slice(&[0, 0, 0xFF, 0, 0, 0, 0xFF, 0]); // 65280x65280
        let crc = crc32(&bytes[12..29]);
        bytes[29..33].copy_from_slice(&crc.to_be_bytes());
        bytes
    };
    let huge_exr = {
        let mut bytes = exr.clone();
        let window = bytes.windows(11).position(|w| w == b"dataWindow\0").unwrap() + 11 + "box2i\0".len() + 4;
        bytes[window + 8..window + 12].copy_from_slice(&1_000_000_000i32.to_le_bytes());
        bytes
    };
    let endless_runs = [&b"#?RADIANCE\n\n-Y 1 +X 9\n\x09\x01\x01\x09"[..], &[1, 1, 1, 0].repeat(9)].concat();
    let cases: &[(Format, &[u8], &str)] = &[
        (Format::Pfm, b"", "ends before the signature"),
        (Format::Pfm, b"P6\n1 1\n255\n", "\"P6\""),
        (Format::Pfm, b"PF\n1 1", "ends before the height"),
        (Format::Pfm, b"PF\n1 x\n-1\n", "the height is \"x\""),
        (Format::Pfm, b"PF\n-1 1\n-1\n", "the width is \"-1\""),
        (Format::Pfm, b"PF\n0 1\n-1\n", "0x1 pixels"),
        (Format::Pfm, b"PF\n1000000000 1000000000\n-1\n", "1000000000x1000000000"),
        (Format::Pfm, b"PF\n65536 65536\n-1\n1234", "too many for a file of"),
        (Format::Pfm, b"PF\n1 1\n0\n123456789abc", "the scale is 0"),
        (Format::Pfm, b"PF\n1 1\nnan\n123456789abc", "the scale is NaN"),
        (Format::Pfm, b"PF\n1 1\n-1\n123456789ab", "11 bytes of pixels, expected 12"),
        (Format::Pfm, b"PF\n1 1\n-1\n123456789abcd", "13 bytes of pixels, expected 12"),
        (Format::Hdr, b"", "does not begin with"),
        (Format::Hdr, b"\x89PNG\r\n", "does not begin with"),
        (Format::Hdr, b"P6\n", "does not begin with"),
        (Format::Hdr, b"#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n", "32-bit_rle_xyze"),
        (Format::Hdr, b"#?RADIANCE\nEXPOSURE=0\n\n-Y 1 +X 1\n", "EXPOSURE is \"0\""),
        (Format::Hdr, b"#?RADIANCE\n", "EOF in header"),
        (Format::Hdr, b"#?RADIANCE\n\n-Y 1\n", "Dimensions line too short"),
        (Format::Hdr, b"#?RADIANCE\n\n+X 1 -Y 1\n1234", "Orientation +X -Y"),
        (Format::Hdr, b"#?RADIANCE\n\n-Y 1 +X -1\n1234", "width dimension"),
        (Format::Hdr, b"#?RADIANCE\n\n-Y 99999 +X 1\n1234", "1x99999"),
        (Format::Hdr, b"#?RADIANCE\n\n-Y 65536 +X 65536\n1234", "too many for a file of"),
        (Format::Hdr, b"#?RADIANCE\n\n-Y 2 +X 1\n1234567", "failed to fill whole buffer"),
        (Format::Hdr, b"#?RADIANCE\n\n-Y 1 +X 9\n\x02\x02\0\x08", ""),
        (Format::Hdr, b"#?RADIANCE\n\n-Y 1 +X 9\n\x02\x02\0\x09\x8A\0", "Wrong length of decoded scanline"),
        (Format::Hdr, b"#?RADIANCE\n\n-Y 1 +X 9\n\x02\x02\0\x09\0", "failed to fill whole buffer"),
        (Format::Hdr, b"#?RADIANCE\n\n-Y 1 +X 9\n\x01\x01\x01\x09", "First pixel of a scanline"),
        (Format::Hdr, b"#?RADIANCE\n\n-Y 1 +X 9\n\x09\x01\x01\x09\x01\x01\x01\x09", "Wrong length of decoded scanline"),
        (Format::Hdr, &endless_runs, "runs of length zero"),
        (Format::Png, b"", ""),
        (Format::Png, b"PF\n1 1\n-1\n", ""),
        (Format::Png, &huge_png, "too many for a file of"),
        (Format::Exr, b"", ""),
        (Format::Exr, b"#?RADIANCE\n", ""),
        (Format::Exr, &huge_exr, "1000000001x5 pixels"),
    ];
    for (format, bytes, reason) in cases {
        match decode(*format, bytes) {
            Ok(_) => panic!("{format} accepted {:?}", String::from_utf8_lossy(bytes)),
            Err(DecodeError::Malformed(problem) | DecodeError::Unsupported(problem)) => {
                assert!(problem.contains(reason) && !problem.is_empty(), "{format}: {problem:?} lacks {reason:?}");
            }
        }
    }
}

fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0u32, |crc, &b| {
        (0..8).fold(crc ^ u32::from(b), |c, _| if c & 1 == 1 { (c >> 1) ^ 0xEDB8_8320 } else { c >> 1 })
    })
}

#[test]
fn truncated_files_are_refused() {
    for format in Format::ALL {
        let bytes = encoded(format, &sample_image(20, 6), &sample_metadata(), Transfer::Gamma(2.2));
        assert!(decode(format, &bytes).is_ok());
        for length in 0..bytes.len() {
            assert!(decode(format, &bytes[..length]).is_err(), "{format} cut to {length} of {} bytes", bytes.len());
        }
    }
}

#[test]
fn damaged_bytes_never_panic() {
    for format in Format::ALL {
        let image = sample_image(20, 6);
        let image = image.clone().with_variance(Variance { of_mean: image.pixels().to_vec(), batches: 4 }).unwrap();
        let bytes = encoded(format, &image, &sample_metadata(), Transfer::Gamma(2.2));
        for position in 0..bytes.len() {
            for value in [0, 0xFF, 0x80, 0x7F, bytes[position] ^ 1, bytes[position].wrapping_add(16)] {
                let mut damaged = bytes.clone();
                damaged[position] = value;
                if let Ok((image, _)) = decode(format, &damaged) {
                    assert_eq!(image.pixels().len(), image.width() as usize * image.height() as usize);
                }
            }
        }
    }
}
