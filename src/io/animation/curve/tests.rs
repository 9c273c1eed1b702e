use std::f64::consts::PI;

use glam::{DQuat, DVec3};

use super::*;

fn curve(times: &[f64], values: &[f64], width: usize, between: Between) -> Curve {
    Curve { times: times.to_vec(), values: values.to_vec(), width, between }
}

#[test]
fn before_the_first_key_and_after_the_last_nothing_moves() {
    let values = [9., 1., 9., 9., 2., 9.];
    for (between, values) in [(Between::Step, &[1., 2.][..]), (Between::Linear, &[1., 2.]), (Between::Cubic, &values)] {
        let curve = curve(&[1.0, 3.0], values, 1, between);
        for (time, value) in [(-1e30, 1.), (0.0, 1.), (1.0, 1.), (3.0, 2.), (4.0, 2.), (1e30, 2.)] {
            assert_eq!(curve.at(time), Some(vec![value]), "{between:?} at {time}");
        }
    }
}

#[test]
fn steps_happen_on_their_keys_and_lines_go_between() {
    let step = curve(&[0.0, 1.0, 1.0, 2.0], &[1., 2., 3., 4.], 1, Between::Step);
    for (time, value) in [(0.999, 1.), (1.0, 3.), (1.5, 3.), (2.0, 4.)] {
        assert_eq!(step.at(time), Some(vec![value]), "at {time}");
    }
    let line = curve(&[1.0, 3.0, 4.0], &[0., 10., 4., 20., 8., 0.], 2, Between::Linear);
    assert_eq!(line.at(1.5), Some(vec![1., 12.5]));
    assert_eq!(line.at(3.75), Some(vec![7., 5.]));
}

/// Keys are stored in f32. The frame of 0.7 s is on the key at 0.7 s, which as an f32 lies before the f64.
#[test]
fn a_frame_that_lies_on_a_key_shows_it() {
    let keys: Vec<f64> = (0..100).map(|frame| f64::from((f64::from(frame) / 30.0) as f32)).collect();
    let values: Vec<f64> = (0..100).map(f64::from).collect();
    let step = curve(&keys, &values, 1, Between::Step);
    for frame in 0..100 {
        assert_eq!(step.at((f64::from(frame) / 30.0) as f32), Some(vec![f64::from(frame)]));
    }
}

/// Between keys with its derivatives as tangents, a cubic polynomial is itself, however long the segments are.
#[test]
fn a_cubic_is_its_own_spline() {
    let p = |t: f64| [2.0 + t - 0.5 * t * t + 0.25 * t * t * t, t * t * t];
    let d = |t: f64| [1.0 - t + 0.75 * t * t, 3.0 * t * t];
    let times = [0.0, 0.5, 2.0, 2.25];
    let values: Vec<f64> = times.iter().flat_map(|&t| [d(t), p(t), d(t)].concat()).collect();
    let spline = curve(&times, &values, 2, Between::Cubic);
    for time in [0.125_f32, 0.5, 0.75, 1.0, 1.75, 2.125] {
        let (found, wanted) = (spline.at(time).unwrap(), p(time.into()));
        for (found, wanted) in found.iter().zip(wanted) {
            assert!((found - wanted).abs() < 1e-12, "{found} is not {wanted} at {time}");
        }
    }
}

/// In and out tangents are told apart: the spline leaves a key by its third element, and reaches one by its first.
#[test]
fn a_spline_leaves_a_key_by_one_tangent_and_reaches_the_next_by_the_other() {
    // Elements (in, value, out) of two keys; only what is named counts.
    let of = |out: f64, into: f64| curve(&[0.0, 2.0], &[1e9, 0., out, into, 0., 1e9], 1, Between::Cubic).at(1.0);
    // At t = ½: d (t³ − 2t² + t) = 2 · ⅛ and d (t³ − t²) = −2 · ⅛.
    assert_eq!(of(1., 0.), Some(vec![0.25]));
    assert_eq!(of(0., 1.), Some(vec![-0.25]));
}

fn about(axis: DVec3, angle: f64) -> DQuat {
    DQuat::from_axis_angle(axis.normalize(), angle)
}

#[test]
fn a_turn_is_even_and_the_shorter_one() {
    let axis = DVec3::new(1., 2., -0.5);
    for (from, to) in [(0.0, 1.0), (0.2, 3.0), (0.0, 1e-9), (1.0, 1.0), (-1.0, 2.1)] {
        for sign in [1.0, -1.0] {
            let (a, b) = (about(axis, from), about(axis, to) * sign);
            let turn = curve(&[0.0, 4.0], &[a.to_array(), b.to_array()].concat(), 4, Between::Spherical);
            for time in [0.5_f32, 1.0, 3.0] {
                let found = DQuat::from_slice(&turn.at(time).unwrap());
                let wanted = about(axis, from + (to - from) * f64::from(time) / 4.0);
                assert!((found.dot(wanted).abs() - 1.0).abs() < 1e-12, "{found} is not {wanted}");
                assert!((found.length() - 1.0).abs() < 1e-12);
            }
        }
    }
    // From 0 to 1.5 π, the shorter way is back.
    let turn = curve(
        &[0.0, 1.0],
        &[about(axis, 0.), about(axis, 1.5 * PI)].map(|q| q.to_array()).concat(),
        4,
        Between::Spherical,
    );
    assert!((DQuat::from_slice(&turn.at(0.5).unwrap()).dot(about(axis, -0.25 * PI)).abs() - 1.0).abs() < 1e-12);
}

#[test]
fn a_spline_of_turns_has_unit_length() {
    let (a, b) = (about(DVec3::X, 0.0), about(DVec3::X, 2.0));
    let zero = [0.0; 4];
    let values = [zero, a.to_array(), zero, zero, b.to_array(), zero].concat();
    let found = DQuat::from_slice(&curve(&[0.0, 1.0], &values, 4, Between::CubicUnit).at(0.5).unwrap());
    assert!((found.length() - 1.0).abs() < 1e-12 && (found.dot(about(DVec3::X, 1.0)).abs() - 1.0).abs() < 1e-12);
}
