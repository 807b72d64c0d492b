//! What the first column is, of clouds in many orders, with and without something before x.

use std::f64::consts::TAU;

use super::{clouds::*, *};
use crate::formats::Limits;

#[derive(Debug, PartialEq)]
enum Told {
    /// The columns from this one on, counted from 0.
    From(usize),
    Refused,
    Wrong(String),
}

/// Which columns of a text are read.
fn told(rows: &[Vec<String>], which: usize) -> Told {
    let text = parted(rows, which);
    match read(text.as_bytes(), &Hints::default(), &Limits::default()) {
        Err(FormatError::FirstColumn { .. }) => Told::Refused,
        Err(error) => Told::Wrong(error.to_string()),
        Ok(cloud) => {
            let from = |begin: usize| {
                rows.len() == cloud.points.len()
                    && rows.iter().zip(&cloud.points).all(|(row, p)| {
                        let three = row.get(begin..begin + 3);
                        three.is_some_and(|t| (0..3).all(|k| t[k].parse() == Ok(p[k])))
                    })
            };
            let begin = (0..2).find(|begin| from(*begin));
            begin.map_or_else(|| Told::Wrong("other columns".into()), Told::From)
        }
    }
}

#[test]
fn clouds_in_any_usual_order_and_form_begin_with_x() {
    let mut random = Random(7);
    let mut wrong = Vec::new();
    let mut count = 0;
    for n in SIZES {
        for (name, points) in orders(n, &mut random) {
            // of the large clouds, each in one place is enough
            let places = if n < 3000 { PLACES.to_vec() } else { vec![PLACES[count % 3]] };
            for (place, at) in places.into_iter().enumerate() {
                for form in FORMS {
                    // what is not looked at in this round is in another
                    let kind = count % 9;
                    let rows: Vec<Vec<String>> = points
                        .iter()
                        .map(|p| {
                            let xyz = [0, 1, 2].map(|k| form.write(p[k] + at[k]));
                            xyz.into_iter().chain(behind(kind, form, &mut random)).collect()
                        })
                        .collect();
                    let found = told(&rows, count);
                    if found != Told::From(0) {
                        wrong.push(format!("{n} {name}, {place}, {form:?}, {kind}: {found:?}"));
                    }
                    count += 1;
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{} of {count}:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn times_before_x_are_passed_over_or_refused() {
    let mut random = Random(3);
    let (mut wrong, mut count) = (Vec::new(), 0);
    for n in [60, 400, 3000] {
        // of 3000 points, one line and a part of the next are looked at
        let along = if n < 3000 { 50 } else { 600 };
        let points = scan(n, along, &mut random);
        let mut jitter = |i: usize| 0.05 * i as f64 + 0.005 * random.unit();
        let seconds: Vec<f64> = (0..n).map(|i| 345_600.0 + jitter(i)).collect();
        let dates: Vec<f64> = (0..n).map(|i| 1.7e9 + jitter(i)).collect();
        let of = |value: &dyn Fn(usize) -> f64| (0..n).map(value).collect::<Vec<f64>>();
        for (name, lead, sure) in [
            ("even steps", of(&|i| 0.1 * (i + 1) as f64), false),
            ("seconds of a week", seconds, false),
            ("seconds since 1970", dates, true),
            ("the same, two returns", of(&|i| 1.7e9 + 0.05 * (i / 2) as f64), true),
            ("whole seconds since 1970", of(&|i| 1.7e9 + (i / 20) as f64), true),
            ("gaps between lines", of(&|i| 0.02 * i as f64 + (i / along) as f64), false),
            ("from each line on", of(&|i| 0.02 * (i % along) as f64), false),
        ] {
            // no line comes again
            if n < 3 * along && name == "from each line on" {
                continue;
            }
            for form in FORMS {
                for lead_form in [form, Form::Shortest, Form::Fixed(2), Form::Fixed(9)] {
                    let kind = count % 9;
                    let rows = behind_lead(&points, &lead, (lead_form, form), kind, &mut random);
                    let found = told(&rows, count);
                    let fixed = |form| matches!(form, Form::Fixed(_) | Form::Exponent(_));
                    let apart = fixed(form) && fixed(lead_form) && form != lead_form;
                    let read = found == Told::From(1);
                    if !read && (sure || apart || found != Told::Refused) {
                        wrong.push(format!("{n} {name}, {form:?} {lead_form:?}: {found:?}"));
                    }
                    count += 1;
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{} of {count}:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn numbers_of_scans_rings_and_points_are_passed_over_or_refused() {
    let mut random = Random(5);
    let (mut wrong, mut count) = (Vec::new(), 0);
    for n in [60, 400, 3000] {
        for (high, points) in
            [(true, surface(1, n, &mut random)), (false, scan(n, 15, &mut random))]
        {
            let of = |value: &dyn Fn(usize) -> usize| (0..n).map(|i| value(i) as f64).collect();
            let leads: [(&str, Vec<f64>); 9] = [
                ("points", of(&|i| i + 1)),
                ("points of a part", of(&|i| i + i / 7)),
                ("points in no order", of(&|i| (i * 37) % n)),
                ("points backwards", of(&|i| n - i)),
                ("rings", of(&|i| i % 16)),
                ("scans", of(&|i| 3 * i / n)),
                ("one scan", of(&|_| 7)),
                ("lines", of(&|i| i / 15)),
                ("classes", of(&|i| (i * 7919) % 65_537 % 5)),
            ];
            for (name, lead) in leads {
                for form in FORMS {
                    let kind = count % 9;
                    let rows = behind_lead(&points, &lead, (Form::Whole, form), kind, &mut random);
                    let found = told(&rows, count);
                    count += 1;
                    // few whole numbers beside digits as needed may be those of a stage, where z may be
                    // an intensity
                    let shortest = matches!(form, Form::Shortest | Form::Pointed);
                    let like_x = shortest && high && matches!(name, "scans" | "lines" | "classes");
                    let right = match found {
                        Told::From(1) => matches!(name, "points"),
                        Told::Refused => name != "points",
                        Told::From(_) => like_x,
                        Told::Wrong(_) => false,
                    };
                    if !right {
                        wrong.push(format!("{n} {name}, {form:?}, {kind}: {found:?}"));
                    }
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{} of {count}:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn a_profile_whose_x_counts_up_keeps_it_or_is_refused() {
    let mut random = Random(9);
    let (mut wrong, mut count) = (Vec::new(), 0);
    for (n, step) in [(60, 1.0), (1280, 1.0), (60, 0.1), (1280, 0.1)] {
        for shape in 0..4 {
            let point = |i: usize| {
                let x = (i + 1) as f64 * step;
                let y = [0.0, 0.01 * x, 3.0 + random.noise(0.01), (0.02 * x).cos()][shape];
                [x, y, 2.0 + (TAU * i as f64 / n as f64).sin() + random.noise(0.01)]
            };
            let points: Vec<_> = (0..n).map(point).collect();
            for form in FORMS {
                for x_form in [form, if step == 1.0 { Form::Shortest } else { form }] {
                    for kind in 1..9 {
                        let rows: Vec<Vec<String>> = points
                            .iter()
                            .map(|[x, y, z]| {
                                let x = std::iter::once(x_form.write(*x));
                                let rest = behind(kind, form, &mut random);
                                x.chain([form.write(*y), form.write(*z)]).chain(rest).collect()
                            })
                            .collect();
                        let found = told(&rows, count);
                        count += 1;
                        let fixed = matches!(form, Form::Fixed(_) | Form::Exponent(_));
                        let apart = fixed && x_form == form && matches!(kind, 1..=3 | 5 | 8);
                        if found != Told::From(0) && (apart || found != Told::Refused) {
                            wrong.push(format!("{n} {shape} {form:?} {x_form:?} {kind} {found:?}"));
                        }
                    }
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{} of {count}:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn running_numbers_are_told_from_x_in_any_order_of_the_points() {
    let mut random = Random(2);
    let (mut wrong, mut count) = (Vec::new(), 0);
    for n in [60, 400, 3000] {
        for (name, mut points) in orders(n, &mut random) {
            // what stays or counts may be x
            if name.contains("grid") || name.contains("lines") || name.contains("whole") {
                continue;
            }
            if name.contains("turned") {
                // a plate
                points.iter_mut().for_each(|p| p[2] = random.noise(0.01));
            }
            let lead: Vec<f64> = (0..n).map(|i| i as f64).collect();
            for form in FORMS {
                let kind = count % 9;
                let rows = behind_lead(&points, &lead, (Form::Whole, form), kind, &mut random);
                let found = told(&rows, count);
                count += 1;
                if found != Told::From(1) {
                    wrong.push(format!("{n} {name}, {form:?}, {kind}: {found:?}"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{} of {count}:\n{}", wrong.len(), wrong.join("\n"));
}
