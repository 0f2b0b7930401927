//! Each improvement taken away.

use crate::ablation::MOST_FOLLOWED;
use crate::frames::{FrameReport, FramesReport};
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
    let mut ways: Vec<&str> = Vec::new();
    for row in frames().flat_map(|frame| &frame.rows) {
        if !ways.contains(&row.contender.as_str()) {
            ways.push(&row.contender);
        }
    }
    let mut groups = Vec::new();
    for (i, way) in ways.into_iter().enumerate() {
        let row = |frame: &'_ FrameReport| frame.rows.iter().position(|row| row.contender == way);
        for frame in frames() {
            let Some(row) = row(frame).map(|at| &frame.rows[at]) else {
                continue;
            };
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
        if i > 0 {
            let length = |frame: &FrameReport| frame.rows[row(frame)?].over_rayward;
            let lengths = frames().map(|frame| length(frame).unwrap_or(f64::NAN));
            groups.push((way.to_owned(), lengths.collect()));
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
    let section = Section::new(format!("Without one improvement: {kind}"));
    let section = if report.frames.iter().any(|frame| frame.triangles > MOST_FOLLOWED) && kind == "eye+soft8"
    {
        section.text(format!(
            "HM08's grid, ray by ray, is left out over {MOST_FOLLOWED} triangles: a frame takes many minutes."
        ))
    } else {
        section
    };
    section.table("", table).plot(plot)
}
