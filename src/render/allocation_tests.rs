//! Tests of the allocation on made-up variances.

use super::allocation::{Allocation, Estimate, Goal, Ladder};

const VALUES: f64 = 96.0;

/// For each tile of a grid the 3×3 around it.
fn grid(columns: usize, tiles: usize) -> Vec<Vec<usize>> {
    let touch =
        |a: usize, b: usize| (a % columns).abs_diff(b % columns) <= 1 && (a / columns).abs_diff(b / columns) <= 1;
    (0..tiles).map(|a| (0..tiles).filter(|&b| touch(a, b)).collect()).collect()
}

/// Climbs with exact variances per sample, and returns the counts.
fn climb(variances: &[f64], tiles_x: usize, most: u32, goal: Goal) -> Vec<u32> {
    let ladder = Ladder::new(most, goal.mean_samples.map(|n| n as u32));
    let mut allocation = Allocation::new(grid(tiles_x, variances.len()), &ladder);
    for _ in 0..100 {
        let counts: Vec<_> = allocation.rungs().iter().map(|&r| ladder.count(r)).collect();
        if allocation.is_finished() {
            return counts;
        }
        let estimate = |(v, &n): (&f64, &u32)| Estimate { error: VALUES * v / f64::from(n), values: VALUES };
        let estimates: Vec<_> = variances.iter().zip(&counts).map(estimate).collect();
        allocation.step(&ladder, &estimates, &goal);
    }
    panic!("never finished");
}

fn mean_error(variances: &[f64], counts: &[u32]) -> f64 {
    variances.iter().zip(counts).map(|(v, &n)| v / f64::from(n)).sum::<f64>() / counts.len() as f64
}

fn mean(counts: &[u32]) -> f64 {
    counts.iter().map(|&n| f64::from(n)).sum::<f64>() / counts.len() as f64
}

/// Two areas, one of which is 256 times as variable: its √v is 16 times the other's.
fn two_areas() -> Vec<f64> {
    (0..1024).map(|t| if t % 32 < 16 { 1.0 } else { 256.0 }).collect()
}

#[test]
fn ladders_are_powers_of_two_up_to_the_most() {
    let counts = |most| {
        let ladder = Ladder::new(most, None);
        ((0..ladder.len()).map(|r| ladder.count(r)).collect::<Vec<_>>(), ladder.count(ladder.base))
    };
    assert_eq!(counts(2), (vec![1, 2], 2));
    assert_eq!(counts(3), (vec![1, 3], 3));
    assert_eq!(counts(16), (vec![4, 8, 16], 16));
    assert_eq!(counts(100), (vec![4, 8, 16, 32, 64, 100], 16));
    assert_eq!(*counts(u32::MAX).0.last().unwrap(), u32::MAX);
}

#[test]
fn the_goal_is_reached_and_not_by_far() {
    let variances = two_areas();
    for goal in [1.0, 0.3, 0.1, 0.017] {
        let counts = climb(&variances, 32, 1 << 20, Goal { variance: goal, mean_samples: None });
        let reached = mean_error(&variances, &counts);
        assert!(reached <= goal && reached > 0.4 * goal, "{goal}: {reached}");
    }
}

#[test]
fn samples_go_with_the_root_of_the_variance() {
    let variances = two_areas();
    let counts = climb(&variances, 32, 1 << 20, Goal { variance: 0.1, mean_samples: None });
    // Away from the border between the areas, where both are mixed.
    let ratio = f64::from(counts[24]) / f64::from(counts[8]);
    assert!((8.0..=32.0).contains(&ratio), "{ratio}");
    // Uniform sampling to the same error takes mean(v)/error, the best allocation mean(√v)²/error.
    let uniform = 128.5 / mean_error(&variances, &counts);
    let best = 8.5 * 8.5 / mean_error(&variances, &counts);
    assert!(mean(&counts) < 1.15 * best && best < 0.6 * uniform, "{} {best} {uniform}", mean(&counts));
}

#[test]
fn limits_hold() {
    let variances = two_areas();
    let counts = climb(&variances, 32, 100, Goal { variance: 1e-9, mean_samples: None });
    assert!(counts.iter().all(|&n| n == 100));
    assert_eq!(Ladder::new(64, Some(4)), Ladder::new(64, Some(5)));
    assert_eq!(Ladder::new(64, Some(4)).count(Ladder::new(64, Some(4)).base), 2);
    for budget in [1.0, 5.0, 16.0, 20.0, 64.0, 200.0] {
        let counts = climb(&variances, 32, 1 << 16, Goal { variance: 0.0, mean_samples: Some(budget) });
        let mean = mean(&counts);
        // Half of the tiles are alike, and rise together.
        assert!(mean <= budget && mean > 0.5 * budget, "{budget}: {mean}");
    }
}

#[test]
fn nothing_is_spent_on_what_has_no_noise() {
    let mut variances = vec![0.0; 1024];
    let goal = Goal { variance: 1e-4, mean_samples: None };
    assert!(climb(&variances, 32, 1024, goal).iter().all(|&n| n == 16));
    // One noisy tile: only it and the tiles around it are sampled.
    variances[33 * 5] = 1e4;
    let counts = climb(&variances, 32, 1024, goal);
    let sampled: Vec<_> = (0..1024).filter(|&t| counts[t] > 16).collect();
    assert!(sampled.contains(&165) && sampled.len() <= 9, "{sampled:?}");
    assert!(sampled.iter().all(|t| (t / 32).abs_diff(5) <= 1 && (t % 32).abs_diff(5) <= 1), "{sampled:?}");
}

#[test]
fn a_half_without_pixels_has_nothing_to_decide() {
    let ladder = Ladder::new(1024, None);
    let mut allocation = Allocation::new(grid(2, 4), &ladder);
    allocation.step(&ladder, &[Estimate::default(); 4], &Goal { variance: 0.1, mean_samples: None });
    assert!(allocation.is_finished() && allocation.rungs().iter().all(|&r| r == ladder.base));
}
