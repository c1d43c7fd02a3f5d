//! Specialization constants.

use crate::check::probe::PlainKernel;
use crate::check::{Case, CheckError, Lab, Measured};
use crate::gpu::Specialization;

pub(super) const CASES: &[Case] = &[
    Case {
        name: "spec/values",
        what: "constants of all types, ids 0 and 2046, what is derived of them, lengths of arrays",
        oracle: "the values that were given",
        quantity: "words that differ",
        threshold: 0.0,
        full_only: false,
        measure: |lab| compared(lab, &[[1, 1, 1], [8, 1, 1]]),
    },
    Case {
        name: "spec/workgroups",
        what: "sizes of workgroups by constants, along one to three axes",
        oracle: "the sizes that were given, and each invocation in its place",
        quantity: "words that differ",
        threshold: 0.0,
        full_only: false,
        measure: |lab| compared(lab, &[[1, 1, 1], [3, 1, 1], [1, 5, 1], [1, 1, 7], [4, 3, 2], [16, 8, 1], [2, 2, 32]]),
    },
];

const SPIRV: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/constants.spv"));

const WORDS: usize = 16;
const WORKGROUPS: u32 = 5;
const GIVEN: u32 = 0x9e37_79b9;

/// Values by id, of shaders/execution/constants.comp.
struct Values {
    first: u32,
    last: u32,
    yes: bool,
    no: bool,
    negative: i32,
    fraction: f32,
    length: u32,
}

const VALUES: [Values; 3] = [
    Values { first: 0, last: u32::MAX, yes: true, no: false, negative: -1, fraction: -0.0, length: 1 },
    Values {
        first: 0x8000_0000,
        last: 1,
        yes: false,
        no: true,
        negative: i32::MIN,
        fraction: f32::INFINITY,
        length: 9,
    },
    Values { first: 77, last: 12, yes: true, no: true, negative: i32::MAX, fraction: 1.175_494_4e-38, length: 32 },
];

fn compared(lab: &Lab, sizes: &[[u32; 3]]) -> Result<Measured, CheckError> {
    let limits = &lab.context.0.limits;
    let fits = |size: &&[u32; 3]| {
        size.iter().product::<u32>() <= limits.max_compute_work_group_invocations
            && size.iter().zip(limits.max_compute_work_group_size).all(|(n, most)| *n <= most)
    };
    let (mut differ, mut all) = (0, 0);
    for size in sizes.iter().filter(fits) {
        for values in &VALUES {
            let count = (WORKGROUPS * size.iter().product::<u32>()) as usize;
            let mut constants = Specialization::default();
            constants.uint(11, size[0]).uint(12, size[1]).uint(13, size[2]);
            constants.uint(0, values.first).uint(2046, values.last).bool(20, values.yes).bool(21, values.no);
            constants.int(22, values.negative).float(23, values.fraction).uint(25, values.length);
            let mut kernel = PlainKernel::new(&lab.context, "constants", SPIRV, &constants, [1, WORDS * count], 1)?;
            let found = kernel.run(&[GIVEN], [0; 2], WORKGROUPS, WORDS * count)?;
            let expected: Vec<u32> = (0..count).flat_map(|i| words(values, *size, i)).collect();
            differ += lab.differing(&format!("workgroups of {size:?}"), &expected, &found);
            all += count;
        }
    }
    Ok(Measured::new(differ as f64, format!("{all} invocations")))
}

/// What an invocation writes.
fn words(values: &Values, size: [u32; 3], invocation: usize) -> [u32; WORDS] {
    let twice = 2 * values.length + 1;
    let both = values.yes && !values.no;
    let reversed = (0..twice).rev().map(|i| i.wrapping_mul(GIVEN));
    let within = invocation as u32 % size.iter().product::<u32>();
    let place = [within % size[0], within / size[0] % size[1], within / (size[0] * size[1])];
    let packed = |[x, y, z]: [u32; 3]| x | y << 10 | z << 20;
    let mut words = [0; WORDS];
    words[..10].copy_from_slice(&[
        values.first,
        values.last,
        u32::from(values.yes) | u32::from(values.no) << 1 | u32::from(both) << 2,
        values.negative as u32,
        values.fraction.to_bits(),
        // The shader's own.
        1234,
        if both { twice } else { values.length },
        reversed.fold(0u32, |sum, x| sum.wrapping_mul(31).wrapping_add(x)),
        packed(size),
        packed(place),
    ]);
    words
}
