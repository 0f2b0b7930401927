//! Curves of the cost of a ray.

use crate::report::{Plot, PlotKind, Section, Series};
use crate::scaling::{Curve, ScalingReport};
use crate::table::{Table, number, spread};

/// A section for each parameter: a plot of all curves and their points.
pub fn scaling(report: &ScalingReport) -> Vec<Section> {
    let mut parameters: Vec<&str> = Vec::new();
    for curve in &report.curves {
        if !parameters.contains(&curve.parameter) {
            parameters.push(curve.parameter);
        }
    }
    let mut sections: Vec<_> = parameters
        .into_iter()
        .map(|parameter| of_parameter(report, parameter))
        .collect();
    if let Some(first) = sections.first_mut() {
        let method = format!(
            "Medians of {} runs (smallest..largest), everything built in every frame. A curve that stays flat says that a \
             ray costs the same.",
            report.runs
        );
        first.items.insert(0, crate::report::Item::Text(method));
    }
    sections
}

fn of_parameter(report: &ScalingReport, parameter: &str) -> Section {
    let curves = || report.curves.iter().filter(|curve| curve.parameter == parameter);
    let series = curves().map(|curve| Series {
        name: format!("{}, {}", curve.scene, curve.frame),
        points: curve.points.iter().map(|p| [p.value, cost(curve, p)]).collect(),
    });
    let time = if parameter == "threads" {
        "wall time"
    } else {
        "processor time"
    };
    let plot = Plot {
        name: format!("scaling-{}", parameter.replace(' ', "-")),
        caption: format!("What a ray costs against {parameter}: {time}, builds included."),
        kind: PlotKind::Curves {
            axes: [parameter.into(), "ns a ray".into()],
            series: series.collect(),
        },
    };
    let section = Section::new(format!("Cost of a ray against {parameter}")).plot(plot);
    curves().fold(section, |section, curve| {
        section.table(format!("{}, {}", curve.scene, curve.frame), points(curve))
    })
}

/// Further threads take processor time from nobody; there it is the wall time that counts.
fn cost(curve: &Curve, point: &crate::scaling::Point) -> f64 {
    if curve.parameter == "threads" {
        point.wall_ns_per_ray
    } else {
        point.ns_per_ray
    }
}

fn points(curve: &Curve) -> Table {
    let stepped = curve.points.iter().any(|point| point.steps.is_some());
    let mut headings = vec![
        curve.parameter,
        "triangles",
        "resolution",
        "rays",
        "frame ms",
        "wall ms",
        "ns a ray",
    ];
    if stepped {
        headings.extend(["cells a ray", "tests a ray"]);
    }
    let mut table = Table::new(&headings);
    for point in &curve.points {
        let mut cells = vec![
            point.value.to_string(),
            point.triangles.to_string(),
            format!("{}x{}", point.resolution[0], point.resolution[1]),
            point.rays.to_string(),
            spread(point.times.cpu_ms),
            spread(point.times.wall_ms),
            number(point.ns_per_ray),
        ];
        cells.extend(point.steps.iter().flatten().map(|&steps| number(steps)));
        table.row(cells);
    }
    table
}
