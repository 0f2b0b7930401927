//! Builds, and what further threads bring.

use crate::build::BuildReport;
use crate::report::{Plot, PlotKind, Section};
use crate::table::{Table, number, pieces, spread};

/// One section.
pub fn build(report: &BuildReport) -> Vec<Section> {
    let threads = report.machine.threads;
    let mut table = Table::new(&[
        "scene",
        "triangles",
        "what",
        "cpu ms",
        "M triangles/s",
        "wall ms, 1",
        &format!("wall ms, {threads}"),
        "speed-up",
        "of fastest",
    ]);
    let mut groups = Vec::new();
    for scene in &report.scenes {
        for (what, scaled) in pieces(scene) {
            table.row(vec![
                scene.scene.clone(),
                scene.triangles.to_string(),
                what.into(),
                spread(scaled.cpu_ms),
                number(scaled.mtriangles_per_s),
                spread(scaled.wall_ms),
                spread(scaled.wall_ms_parallel),
                number(scaled.speed_up),
                number(scaled.speed_up_of_fastest),
            ]);
        }
        let speed_ups = pieces(scene).iter().map(|(_, scaled)| scaled.speed_up).collect();
        groups.push((scene.scene.clone(), speed_ups));
    }
    let series = report
        .scenes
        .first()
        .map(|scene| pieces(scene).map(|(what, _)| what.to_owned()));
    let plot = Plot {
        name: "threads".into(),
        caption: format!("Wall time on one thread over that on {threads}."),
        kind: PlotKind::Bars {
            axis: format!("times as fast on {threads} threads"),
            series: series.into_iter().flatten().collect(),
            groups,
            mark: Some(threads as f64),
        },
    };
    let method = format!(
        "Medians of {} runs in turns (smallest..largest); processor time on one thread, wall time on 1 and {threads}.",
        report.runs
    );
    vec![
        Section::new("Builds and threads")
            .text(method)
            .table("", table)
            .plot(plot),
    ]
}
