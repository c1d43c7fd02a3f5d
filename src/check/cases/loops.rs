//! Loops, which compilers of shaders rewrite.

use crate::check::probe::{FUNCTION, PlainKernel, WORKGROUP};
use crate::check::rng::Rng;
use crate::check::{Case, CheckError, Lab, Measured};
use crate::gpu::Specialization;

pub(super) const CASES: &[Case] = &[
    Case {
        name: "loops/nested",
        what: "three loops in each other, left and gone on with from within",
        oracle: "the same on the host",
        quantity: "words that differ",
        threshold: 0.0,
        full_only: false,
        measure: |lab| compared(lab, NESTED, nested),
    },
    Case {
        name: "loops/shapes",
        what: "loops up, down, with their test at the end, and without one",
        oracle: "the same on the host",
        quantity: "words that differ",
        threshold: 0.0,
        full_only: false,
        measure: |lab| compared(lab, SHAPES, shapes),
    },
    Case {
        name: "loops/search",
        what: "loops that each lane leaves when it has found something",
        oracle: "the same on the host",
        quantity: "words that differ",
        threshold: 0.0,
        full_only: false,
        measure: |lab| compared(lab, SEARCH, search),
    },
    Case {
        name: "loops/long",
        what: "100,000 iterations, of one loop and of two",
        oracle: "the same on the host",
        quantity: "words that differ",
        threshold: 0.0,
        full_only: false,
        measure: long,
    },
];

const SPIRV: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/loops.spv"));

// Functions of shaders/execution/loops.comp.
const NESTED: u32 = 0;
const SHAPES: u32 = 1;
const LONG: u32 = 2;
const SEARCH: u32 = 3;

const SIZE: u32 = 64;
const WORKGROUPS: u32 = 64;

fn kernel(lab: &Lab, function: u32, given: usize, found: usize) -> Result<PlainKernel, CheckError> {
    let mut constants = Specialization::default();
    constants.uint(WORKGROUP, SIZE).uint(FUNCTION, function);
    PlainKernel::new(&lab.context, "loops", SPIRV, &constants, [given, found], 1)
}

fn compared(lab: &Lab, function: u32, oracle: fn(u32) -> u32) -> Result<Measured, CheckError> {
    let count = (SIZE * WORKGROUPS) as usize;
    let mut rng = Rng::new(7);
    let given: Vec<u32> = (0..count).map(|_| rng.bits()).collect();
    let found = kernel(lab, function, count, count)?.run(&given, [0; 2], WORKGROUPS, count)?;
    let expected: Vec<u32> = given.iter().map(|&x| oracle(x)).collect();
    Ok(Measured::new(lab.differing("loops", &expected, &found) as f64, format!("{count} invocations")))
}

fn long(lab: &Lab) -> Result<Measured, CheckError> {
    let count = SIZE as usize;
    let mut kernel = kernel(lab, LONG, count, 2 * count)?;
    let given: Vec<u32> = (0..SIZE).collect();
    let (mut differ, mut fewest) = (0, u32::MAX);
    for [first, second] in [[100_000, 0], [50_000, 50_000], [0, 100_000]] {
        let found = kernel.run(&given, [first, second], 1, 2 * count)?;
        let expected: Vec<u32> = given.iter().flat_map(|&x| iterations(x, first + second)).collect();
        differ += lab.differing(&format!("{first} and {second} iterations"), &expected, &found);
        fewest = fewest.min(found.iter().step_by(2).copied().min().unwrap_or(0));
    }
    Ok(Measured::new(differ as f64, format!("at least {fewest} of 100000 iterations")))
}

fn next(x: u32) -> u32 {
    x.wrapping_mul(1_664_525).wrapping_add(1_013_904_223)
}

/// How many iterations count, and where the sequence is then.
fn iterations(mut x: u32, count: u32) -> [u32; 2] {
    let mut done = 0;
    for _ in 0..count {
        x = next(x);
        done += u32::from(x != 0x8000_0001);
    }
    [done, x]
}

fn nested(x: u32) -> u32 {
    let mut count = 0u32;
    for a in 0..x & 3 {
        for b in 0..x >> 2 & 3 {
            if b == x >> 8 & 3 {
                continue;
            }
            for c in 0..x >> 4 & 3 {
                if c == x >> 10 & 3 {
                    break;
                }
                count = count.wrapping_mul(3).wrapping_add(a * 7 + b * 5 + c);
            }
            count = count.wrapping_add(1);
        }
    }
    count
}

fn shapes(x: u32) -> u32 {
    let n = x & 31;
    let push = |sum: u32, i: u32| sum.wrapping_mul(31).wrapping_add(i);
    let mut sum = (0..n).fold(0, push);
    sum = (1..=n).rev().fold(sum, push);
    sum = (0..).map(|k| n as i32 - 2 * k).take_while(|i| *i >= -3).fold(sum, |sum, i| push(sum, i as u32));
    let mut i = n;
    loop {
        sum ^= i.wrapping_mul(2_654_435_761);
        i /= 2;
        if i == 0 {
            break;
        }
    }
    loop {
        i += 3;
        if i > n {
            return sum;
        }
        if i & 4 == 0 {
            sum = push(sum, i);
        }
    }
}

fn search(x: u32) -> u32 {
    let (mut y, mut tries) = (x, 0);
    while y & 63 != 0 && tries < 1000 {
        y = next(y);
        tries += 1;
        if y >> 20 & 255 == 7 {
            break;
        }
    }
    y ^ tries
}
