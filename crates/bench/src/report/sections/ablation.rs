//! Each improvement taken away.

use crate::frames::FramesReport;
use crate::report::{Plot, PlotKind, Section};
use crate::table::{Table, number, optional, spread};

/// A section for each kind of frame: all ways in all scenes.
pub fn ablation(report: &FramesReport) -> Vec<Section> {
    let mut kinds: Vec<&str> = Vec::new();
    for frame in &report.frames {
        if !kinds.contains(&frame.frame) {
            kinds.push(frame.frame);
        }
    }
    kinds.into_iter().map(|kind| of_kind(report, kind)).collect()
}

fn of_kind(report: &FramesReport, kind: &str) -> Section {
    let frames = || report.frames.iter().filter(|frame| frame.frame == kind);
    let mut table = Table::new(&[
        "way",
        "scene",
        "frame ms",
        "wall ms",
        "x the usual way",
        "pixels that differ",
    ]);
    let ways = frames().next().map_or(0, |frame| frame.rows.len());
    let mut groups = Vec::new();
    for way in 0..ways {
        for frame in frames() {
            let row = &frame.rows[way];
            table.row(vec![
                row.contender.clone(),
                frame.scene.clone(),
                row.times
                    .map_or("ANOTHER PICTURE".into(), |times| spread(times.cpu_ms)),
                row.times.map_or("-".into(), |times| number(times.wall_ms.median)),
                optional(row.over_rayward),
                row.differing_pixels.to_string(),
            ]);
        }
        if way > 0 {
            let name = frames()
                .next()
                .map_or(String::new(), |frame| frame.rows[way].contender.clone());
            let lengths = frames().map(|frame| frame.rows[way].over_rayward.unwrap_or(f64::NAN));
            groups.push((name, lengths.collect()));
        }
    }
    let plot = Plot {
        name: format!("ablation-{}", kind.replace('+', "-")),
        caption: format!("Processor time of frames \"{kind}\" without one improvement, over that with all."),
        kind: PlotKind::Bars {
            axis: "times the processor time".into(),
            series: frames().map(|frame| frame.scene.clone()).collect(),
            groups,
            mark: Some(1.0),
        },
    };
    Section::new(format!("Without one improvement: {kind}"))
        .table("", table)
        .plot(plot)
}
