//! FLIP against the authors' evaluator, and properties.

use crate::image::metrics::flip::*;

const SIZE: (u32, u32) = (48, 40);

fn picture(f: impl Fn(f64, f64) -> [f64; 3]) -> Image {
    Image::from_fn(SIZE.0, SIZE.1, |x, y| f(f64::from(x), f64::from(y)).map(|v| v as f32)).unwrap()
}

fn base(x: f64, y: f64) -> [f64; 3] {
    [
        0.5 + 0.5 * (0.3 * x).sin() * (0.2 * y).cos(),
        0.5 + 0.4 * (0.17 * x + 0.11 * y).cos(),
        0.3 + 0.3 * (0.5 * y).sin(),
    ]
}

fn brighter(x: f64, y: f64) -> [f64; 3] {
    base(x, y).map(|v| (1.1 * v).min(1.0))
}

fn dots(x: f64, y: f64) -> [f64; 3] {
    if (7.0 * x + 13.0 * y) % 61.0 == 0.0 { [1.0; 3] } else { base(x, y) }
}

fn tint(x: f64, y: f64) -> [f64; 3] {
    let [r, g, b] = base(x, y);
    [r, 0.8 * g, 1.0 - b]
}

fn checker(x: f64, y: f64) -> [f64; 3] {
    [((x / 4.0).floor() + (y / 4.0).floor()) % 2.0; 3]
}

fn mean_flip(a: &Image, b: &Image, ppd: f64) -> f64 {
    crate::image::metrics::mean(&flip(a, b, ppd).unwrap())
}

/// Values of the authors' evaluator (flip-evaluator 1.7, LDR, linear input, which computes in single
/// precision): the mean, and pixels (0, 0), (17, 20) and (47, 39).
#[test]
fn equals_the_authors_evaluator() {
    type Case = (&'static str, fn(f64, f64) -> [f64; 3], fn(f64, f64) -> [f64; 3], f64, f64, [f64; 3]);
    let cases: [Case; 8] = [
        ("brighter", base, brighter, 67.0, 0.207627, [0.230457, 0.233189, 0.234667]),
        ("dots", base, dots, 67.0, 0.072997, [0.671879, 0.156783, 0.008849]),
        ("tint", base, tint, 67.0, 0.729459, [0.731423, 0.906649, 0.756537]),
        ("checker", base, checker, 67.0, 0.842776, [0.990011, 0.762642, 0.988421]),
        ("dots from afar", base, dots, 30.0, 0.059668, [0.825552, 0.264116, 0.0]),
        ("shifted", checker, |x, y| checker(x + 1.0, y), 67.0, 0.307350, [0.273553, 0.0, 0.979479]),
        ("black and white", |_, _| [0.0; 3], |_, _| [1.0; 3], 67.0, 0.967401, [0.967392; 3]),
        ("green and blue", |_, _| [0.0, 1.0, 0.0], |_, _| [0.0, 0.0, 1.0], 67.0, 1.0, [1.0; 3]),
    ];
    for (name, a, b, ppd, mean, pixels) in cases {
        let map = flip(&picture(a), &picture(b), ppd).unwrap();
        let found = crate::image::metrics::mean(&map);
        assert!((found - mean).abs() < 1e-4, "{name}: mean {found}, expected {mean}");
        for ((x, y), expected) in [(0, 0), (17, 20), (47, 39)].into_iter().zip(pixels) {
            let found = map[y * SIZE.0 as usize + x];
            // Where nothing differs but roundoff, the exponents make much of it.
            assert!((found - expected).abs() < 1e-3, "{name} at ({x}, {y}): {found}, expected {expected}");
        }
    }
}

#[test]
fn equal_images_and_symmetry_and_order() {
    let reference = picture(base);
    assert!(flip(&reference, &reference, 67.0).unwrap().iter().all(|&e| e == 0.0));
    let other = picture(dots);
    assert!((mean_flip(&reference, &other, 67.0) - mean_flip(&other, &reference, 67.0)).abs() < 1e-12);
    let darker = |k: f64| picture(|x, y| base(x, y).map(|v| k * v));
    let errors = [0.99, 0.95, 0.9, 0.7, 0.4, 0.0].map(|k| mean_flip(&darker(k), &reference, 67.0));
    assert!(errors.is_sorted() && errors[0] > 0.0, "{errors:?}");
}

#[test]
fn values_beyond_the_display_are_clamped() {
    let shown = Image::from_pixels(2, 1, vec![[1.0, 0.0, 0.0], [0.0; 3]]).unwrap();
    let beyond = Image::from_pixels(2, 1, vec![[f32::INFINITY, -2.0, 0.0], [f32::NAN; 3]]).unwrap();
    assert_eq!(flip(&shown, &beyond, 67.0).unwrap(), [0.0; 2]);
    assert!(matches!(flip(&shown, &Image::new(1, 1).unwrap(), 67.0), Err(ImageError::SizeMismatch { .. })));
}
