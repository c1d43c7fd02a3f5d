//! What the lanes of a subgroup do together, one by one against their meaning.

use crate::check::probe::{FUNCTION, PlainKernel, WORKGROUP, workgroups};
use crate::check::rng::Rng;
use crate::check::{Case, CheckError, Lab, Measured};
use crate::gpu::Specialization;

pub(super) const CASES: &[Case] = &[
    Case {
        name: "lanes/ids",
        what: "numbers of subgroups and lanes, in workgroups of 1 to 256",
        oracle: "each pair once, below the sizes that the device tells",
        quantity: "invocations with another",
        threshold: 0.0,
        full_only: false,
        measure: ids,
    },
    Case {
        name: "lanes/arithmetic",
        what: "sums, bounds, bits, inclusive and exclusive, in workgroups of 1 to 256",
        oracle: "the same, lane by lane",
        quantity: "words that differ",
        threshold: 0.0,
        full_only: false,
        measure: |lab| compared(lab, ARITHMETIC, arithmetic),
    },
    Case {
        name: "lanes/divergent",
        what: "sums of the lanes in a branch, in loops of different lengths, and of all behind them",
        oracle: "the same, lane by lane",
        quantity: "words that differ",
        threshold: 0.0,
        full_only: false,
        measure: |lab| compared(lab, DIVERGENT, divergent),
    },
    Case {
        name: "lanes/ballot",
        what: "ballots, their bits, and votes, in workgroups of 1 to 256",
        oracle: "the same, lane by lane",
        quantity: "words that differ",
        threshold: 0.0,
        full_only: false,
        measure: |lab| compared(lab, BALLOT, ballot),
    },
    Case {
        name: "lanes/broadcast",
        what: "values of each lane, of the first, and of the first in a branch",
        oracle: "the same, lane by lane",
        quantity: "words that differ",
        threshold: 0.0,
        full_only: false,
        measure: |lab| compared(lab, BROADCAST, broadcast),
    },
    Case {
        name: "lanes/shuffle",
        what: "values of the next lane, of any, and across one bit",
        oracle: "the same, lane by lane",
        quantity: "words that differ",
        threshold: 0.0,
        full_only: false,
        measure: |lab| {
            if !lab.context.info().shuffles {
                return Err(CheckError::NotSupported("its subgroups do not shuffle".to_owned()));
            }
            compared(lab, SHUFFLE, shuffle)
        },
    },
];

const SPIRV: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/lanes.spv"));

// Functions of shaders/execution/lanes.comp.
const IDS: u32 = 0;
const ARITHMETIC: u32 = 1;
const DIVERGENT: u32 = 2;
const BALLOT: u32 = 3;
const BROADCAST: u32 = 4;
const SHUFFLE: u32 = 5;

/// Words of an invocation, of which the first tell where it is.
const WORDS: usize = 16;
const PLACE: usize = 4;
const WORKGROUPS: u32 = 17;
const NONE: u32 = u32::MAX;

/// The lanes of a subgroup that are there: number, invocation, value.
#[derive(Debug, Clone)]
struct Lane {
    lane: u32,
    invocation: usize,
    x: u32,
}

struct Subgroup {
    /// In the order of their numbers.
    lanes: Vec<Lane>,
    size: u32,
}

impl Subgroup {
    fn at(&self, lane: u32) -> u32 {
        self.lanes.iter().find(|l| l.lane == lane).map_or(NONE, |l| l.x)
    }
}

/// What the kernel writes for given words, in workgroups of a size.
fn run(lab: &Lab, function: u32, size: u32) -> Result<(Vec<u32>, Vec<u32>), CheckError> {
    let count = (WORKGROUPS * size) as usize;
    let mut rng = Rng::new(u64::from(size));
    let given: Vec<u32> = (0..count).map(|_| rng.bits()).collect();
    let mut constants = Specialization::default();
    constants.uint(WORKGROUP, size).uint(FUNCTION, function);
    let mut kernel = PlainKernel::new(&lab.context, "lanes", SPIRV, &constants, [count, WORDS * count], 1)?;
    let found = kernel.run(&given, [0; 2], WORKGROUPS, WORDS * count)?;
    Ok((given, found))
}

fn ids(lab: &Lab) -> Result<Measured, CheckError> {
    let (mut wrong, mut all) = (0, 0);
    for size in workgroups(&lab.context) {
        let (given, found) = run(lab, IDS, size)?;
        all += given.len();
        let mut expected = found.clone();
        for (found, expected) in found.chunks(WORDS * size as usize).zip(expected.chunks_mut(WORDS * size as usize)) {
            let last = found.iter().step_by(WORDS).max().map_or(0, |last| *last);
            let mut places: Vec<[u32; 2]> = Vec::new();
            for (row, expected) in found.chunks(WORDS).zip(expected.chunks_mut(WORDS)) {
                let &[subgroup, lane, lanes, subgroups, ..] = row else { continue };
                expected[2] = lab.context.info().subgroup_size;
                expected[3] = subgroups.max(last + 1);
                let is_right = row == expected && lane < lanes && !places.contains(&[subgroup, lane]);
                wrong += usize::from(!is_right);
                places.push([subgroup, lane]);
            }
        }
        lab.differing(&format!("workgroups of {size}: subgroup, lane, lanes, subgroups"), &expected, &found);
    }
    Ok(Measured::new(wrong as f64, format!("{all} invocations")))
}

/// Words of an invocation that an oracle expects, from [`PLACE`] on.
type Oracle = fn(&Subgroup, &Lane) -> Vec<u32>;

fn compared(lab: &Lab, function: u32, oracle: Oracle) -> Result<Measured, CheckError> {
    let (mut differ, mut all) = (0, 0);
    for size in workgroups(&lab.context) {
        let (given, found) = run(lab, function, size)?;
        let mut expected = found.clone();
        for workgroup in 0..WORKGROUPS as usize {
            let first = workgroup * size as usize;
            for subgroup in subgroups_of(&given, &found, first..first + size as usize) {
                for lane in &subgroup.lanes {
                    let row = WORDS * lane.invocation + PLACE;
                    let words = oracle(&subgroup, lane);
                    all += words.len();
                    expected[row..row + words.len()].copy_from_slice(&words);
                }
            }
        }
        differ += lab.differing(&format!("workgroups of {size}"), &expected, &found);
    }
    Ok(Measured::new(differ as f64, format!("{all} words")))
}

/// The subgroups of a workgroup, as its invocations tell.
fn subgroups_of(given: &[u32], found: &[u32], invocations: std::ops::Range<usize>) -> Vec<Subgroup> {
    let mut all: std::collections::BTreeMap<u32, Subgroup> = Default::default();
    for invocation in invocations {
        let &[subgroup, lane, size, ..] = &found[WORDS * invocation..] else { continue };
        let lanes = &mut all.entry(subgroup).or_insert(Subgroup { lanes: Vec::new(), size }).lanes;
        lanes.push(Lane { lane, invocation, x: given[invocation] });
    }
    let mut all: Vec<_> = all.into_values().collect();
    all.iter_mut().for_each(|subgroup| subgroup.lanes.sort_by_key(|l| l.lane));
    all
}

fn sum(values: impl Iterator<Item = u32>) -> u32 {
    values.fold(0, u32::wrapping_add)
}

fn arithmetic(subgroup: &Subgroup, own: &Lane) -> Vec<u32> {
    let all = || subgroup.lanes.iter().map(|l| l.x);
    let before = || subgroup.lanes.iter().filter(|l| l.lane < own.lane).map(|l| l.x);
    vec![
        sum(all()),
        all().min().unwrap_or(NONE),
        all().max().unwrap_or(0),
        all().fold(NONE, |a, x| a & (x | 0xff0)),
        all().fold(0, |a, x| a | (x & 0xff0)),
        all().fold(0, |a, x| a ^ x),
        sum(before()).wrapping_add(own.x),
        sum(before()),
        before().max().unwrap_or(0).max(own.x),
        before().fold(0, |a, x| a ^ x),
    ]
}

fn divergent(subgroup: &Subgroup, own: &Lane) -> Vec<u32> {
    let lanes = || subgroup.lanes.iter().map(|l| l.x);
    let branch = if own.x & 1 != 0 {
        sum(lanes().filter(|x| x & 1 != 0))
    } else {
        lanes().filter(|x| x & 1 == 0).max().unwrap_or(0)
    };
    let turns = |x: u32| x >> 4 & 7;
    let step =
        |sums: u32, i: u32| sums.wrapping_mul(31).wrapping_add(sum(lanes().filter(|&x| turns(x) > i).map(|x| x >> 8)));
    let sums = (0..turns(own.x)).fold(0, step);
    let turns = |x: u32| x >> 7 & 3;
    let step = |left: u32, i: u32| {
        if own.x & 2 != 0 {
            return left;
        }
        let there = lanes().filter(|&x| turns(x) > i && x & 2 == 0);
        left.wrapping_mul(31).wrapping_add(there.fold(0, |a, x| a ^ x))
    };
    let left = (0..turns(own.x)).fold(0, step);
    let count = subgroup.lanes.len() as u32;
    vec![branch, sums, count, left, count]
}

fn ballot(subgroup: &Subgroup, own: &Lane) -> Vec<u32> {
    let odd: Vec<u32> = subgroup.lanes.iter().filter(|l| l.x & 1 != 0).map(|l| l.lane).collect();
    let word = |i: u32| odd.iter().filter(|lane| **lane / 32 == i).fold(0, |a, lane| a | 1 << (lane % 32));
    let count = |below: u32| odd.iter().filter(|lane| **lane < below).count() as u32;
    let is_odd = own.x & 1 != 0;
    let votes = [
        !odd.is_empty(),
        odd.len() == subgroup.lanes.len(),
        subgroup.lanes.iter().all(|l| l.x >> 30 == own.x >> 30),
        subgroup.lanes[0].lane == own.lane,
        is_odd,
    ];
    let votes = votes.iter().enumerate().fold(0, |a, (i, vote)| a | u32::from(*vote) << i);
    vec![
        word(0),
        word(1),
        word(2),
        word(3),
        count(NONE),
        count(own.lane + 1),
        count(own.lane),
        odd.first().copied().unwrap_or(NONE),
        odd.last().copied().unwrap_or(NONE),
        votes,
        u32::from(odd.contains(&(own.lane / 2))),
    ]
}

fn broadcast(subgroup: &Subgroup, own: &Lane) -> Vec<u32> {
    let all = subgroup.lanes.iter().fold(0u32, |a, l| a.wrapping_mul(31).wrapping_add(l.x));
    let first_odd = subgroup.lanes.iter().find(|l| l.x & 1 != 0).map_or(0, |l| l.x);
    vec![all, subgroup.lanes[0].x, if own.x & 1 != 0 { first_odd } else { 0 }]
}

fn shuffle(subgroup: &Subgroup, own: &Lane) -> Vec<u32> {
    let size = subgroup.size.max(1);
    let mut words = vec![subgroup.at((own.lane + 1) % size), subgroup.at(own.x % size)];
    words.extend((0..3).map(|bit| subgroup.at(own.lane ^ 1 << bit)));
    words
}
