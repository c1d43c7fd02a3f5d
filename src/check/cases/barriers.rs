//! Memory that a workgroup shares, and atomics.

use crate::check::probe::{FUNCTION, PlainKernel, WORKGROUP, workgroups};
use crate::check::rng::Rng;
use crate::check::{Case, CheckError, Lab, Measured};
use crate::gpu::Specialization;

pub(super) const CASES: &[Case] = &[
    Case {
        name: "barrier/ping-pong",
        what: "values that go round in shared memory, with a barrier each time, in workgroups of 1 to 256",
        oracle: "the same, one after the other",
        quantity: "words that differ",
        threshold: 0.0,
        full_only: false,
        measure: |lab| by_workgroup(lab, PING_PONG, ping_pong),
    },
    Case {
        name: "barrier/cleared",
        what: "a shared counter, cleared by one and counted up by all, a hundred times",
        oracle: "the same, one after the other",
        quantity: "words that differ",
        threshold: 0.0,
        full_only: false,
        measure: |lab| by_workgroup(lab, CLEARED, cleared),
    },
    Case {
        name: "barrier/prefix",
        what: "sums of all before, in shared memory",
        oracle: "the same, one after the other",
        quantity: "words that differ",
        threshold: 0.0,
        full_only: false,
        measure: |lab| by_workgroup(lab, PREFIX, prefix),
    },
    Case {
        name: "barrier/tickets",
        what: "numbers that invocations of all workgroups draw from a counter in memory, and sign",
        oracle: "each number is drawn once, and each signs once",
        quantity: "words that differ",
        threshold: 0.0,
        full_only: false,
        measure: tickets,
    },
];

const SPIRV: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/barriers.spv"));

// Of shaders/execution/barriers.comp.
const PING_PONG: u32 = 0;
const CLEARED: u32 = 1;
const TICKETS: u32 = 2;
const PREFIX: u32 = 3;
const SIZE: u32 = 3;
const ROUNDS: u32 = 100;
const WORKGROUPS: u32 = 23;

fn kernel(lab: &Lab, function: u32, size: u32, found: usize) -> Result<(PlainKernel, Vec<u32>), CheckError> {
    let count = (WORKGROUPS * size) as usize;
    let mut rng = Rng::new(u64::from(size));
    let given = (0..count).map(|_| rng.bits()).collect();
    let mut constants = Specialization::default();
    constants.uint(WORKGROUP, size).uint(SIZE, size).uint(FUNCTION, function);
    Ok((PlainKernel::new(&lab.context, "barriers", SPIRV, &constants, [count, found], 1)?, given))
}

/// What the invocations of a workgroup find, for what they are given.
type Oracle = fn(&[u32]) -> Vec<u32>;

fn by_workgroup(lab: &Lab, function: u32, oracle: Oracle) -> Result<Measured, CheckError> {
    let (mut differ, mut all) = (0, 0);
    for size in workgroups(&lab.context) {
        let count = (WORKGROUPS * size) as usize;
        let (mut kernel, given) = kernel(lab, function, size, count)?;
        let found = kernel.run(&given, [0; 2], WORKGROUPS, count)?;
        let expected: Vec<u32> = given.chunks(size as usize).flat_map(oracle).collect();
        differ += lab.differing(&format!("workgroups of {size}"), &expected, &found);
        all += count;
    }
    Ok(Measured::new(differ as f64, format!("{all} invocations")))
}

fn ping_pong(given: &[u32]) -> Vec<u32> {
    let size = given.len();
    let mut ping = given.to_vec();
    for round in 0..ROUNDS {
        let pong: Vec<u32> =
            (0..size).map(|i| ping[(i + 1) % size].wrapping_mul(1_664_525).wrapping_add(round)).collect();
        ping = (0..size).map(|i| pong[(i + size - 1) % size] ^ pong[7 * i % size]).collect();
    }
    ping
}

fn cleared(given: &[u32]) -> Vec<u32> {
    let counted = |round: u32| given.iter().fold(0u32, |sum, x| sum.wrapping_add(x.wrapping_add(round) & 0xffff));
    let sums = (0..ROUNDS).fold(0u32, |sums, round| sums.wrapping_mul(31).wrapping_add(counted(round)));
    vec![sums; given.len()]
}

fn prefix(given: &[u32]) -> Vec<u32> {
    let mut sum = 0u32;
    given
        .iter()
        .map(|x| {
            sum = sum.wrapping_add(*x);
            sum
        })
        .collect()
}

fn tickets(lab: &Lab) -> Result<Measured, CheckError> {
    let (mut differ, mut all) = (0, 0);
    for size in workgroups(&lab.context) {
        let count = (WORKGROUPS * size) as usize;
        let (mut kernel, mut given) = kernel(lab, TICKETS, size, count + 2)?;
        let mut found = kernel.run(&given, [0; 2], WORKGROUPS, count + 2)?;
        // Who draws which number is free.
        found[1..=count].sort_unstable();
        given.sort_unstable();
        let largest = given.last().copied().unwrap_or(0);
        let expected = [&[count as u32][..], &given, &[largest]].concat();
        differ += lab.differing(&format!("workgroups of {size}, numbers sorted"), &expected, &found);
        all += count;
    }
    Ok(Measured::new(differ as f64, format!("{all} invocations")))
}
