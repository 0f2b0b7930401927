//! Frames beside other ray tracers.

use crate::frames::{FrameReport, FramesReport};
use crate::report::{Plot, PlotKind, Section};
use crate::table::{Table, number, optional, spread};

/// Ratios of all frames, then each frame with all contenders.
pub fn frames(report: &FramesReport) -> Vec<Section> {
    let embree = match report.embree.len() {
        0 => "not found".to_owned(),
        _ => report.embree.join(" and "),
    };
    let method = format!(
        "{}x{}, medians of {} runs in turns (smallest..largest), processor time; Embree: {embree}. Rayward builds \
         everything in every frame; what the others keep is built once and in no frame's time. Pictures were \
         compared before.",
        report.width, report.height, report.runs
    );
    let mut ratios = Section::new("Frames beside other ray tracers").text(method);
    if let Some(plot) = bars(report) {
        let mut table = Table::new(&[
            "scene",
            "triangles",
            "frame",
            "ours, ms",
            "x the fastest",
            "which is",
        ]);
        for frame in &report.frames {
            let ms = frame.rows[0].times.map(|times| times.cpu_ms.median);
            table.row(vec![
                frame.scene.clone(),
                frame.triangles.to_string(),
                frame.frame.into(),
                optional(ms),
                optional(frame.ratio),
                frame.best_peer.clone().unwrap_or_else(|| "-".into()),
            ]);
        }
        ratios = ratios.table("", table).plot(plot);
    }
    let each = report.frames.iter().map(one_frame);
    std::iter::once(ratios).chain(each).collect()
}

/// Our ratio to the fastest of the others; `None` without others.
fn bars(report: &FramesReport) -> Option<Plot> {
    let mut kinds: Vec<&str> = Vec::new();
    let mut groups: Vec<(String, Vec<f64>)> = Vec::new();
    for frame in &report.frames {
        let ratio = frame.ratio?;
        let kind = kinds.iter().position(|kind| *kind == frame.frame);
        let kind = kind.unwrap_or_else(|| {
            kinds.push(frame.frame);
            kinds.len() - 1
        });
        if groups.last().is_none_or(|(scene, _)| *scene != frame.scene) {
            groups.push((frame.scene.clone(), Vec::new()));
        }
        let lengths = &mut groups.last_mut()?.1;
        lengths.resize(lengths.len().max(kind + 1), f64::NAN);
        lengths[kind] = ratio;
    }
    Some(Plot {
        name: "frames".into(),
        caption: "Processor time of the fastest other ray tracer, its structures built before, over that of Rayward, \
                  which rebuilds its own in every frame."
            .into(),
        kind: PlotKind::Bars {
            axis: "times as fast as the fastest of the others".into(),
            series: kinds.into_iter().map(str::to_owned).collect(),
            groups,
            mark: Some(1.0),
        },
    })
}

fn one_frame(frame: &FrameReport) -> Section {
    let title = format!(
        "{}, {} triangles, {}: {} eye rays, {} shadow rays",
        frame.scene, frame.triangles, frame.frame, frame.eye_rays, frame.shadow_rays
    );
    let mut table = Table::new(&[
        "contender",
        "frame ms",
        "wall ms",
        "Mray/s",
        "x rayward",
        "kept build ms",
        "pixels that differ",
    ]);
    for row in &frame.rows {
        let (cpu, wall) = match &row.times {
            Some(times) => (spread(times.cpu_ms), number(times.wall_ms.median)),
            None => ("ANOTHER PICTURE".into(), "-".into()),
        };
        table.row(vec![
            row.contender.clone(),
            cpu,
            wall,
            optional(row.mray_per_s),
            optional(row.over_rayward),
            optional(row.kept_build_ms),
            row.differing_pixels.to_string(),
        ]);
    }
    let section = Section::new(title).table("", table);
    match (frame.ratio, &frame.best_peer) {
        (Some(ratio), Some(peer)) => {
            section.text(format!("rayward is {} times as fast as {peer}", number(ratio)))
        }
        _ => section,
    }
}
