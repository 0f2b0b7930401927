//! Reports as text for people, and as rows for spreadsheets.

use crate::build::{BuildReport, Scaled, SceneBuilds};
use crate::claims::Verdict;
use crate::frames::{FrameReport, FramesReport};
use crate::scaling::ScalingReport;
use crate::steps::StepReport;
use crate::tables::TablesReport;
use crate::{Machine, Spread};

/// A table whose columns are as wide as they need to be; the first is aligned to the left, the others to the right.
#[derive(Clone, Debug, Default)]
pub struct Table {
    rows: Vec<Vec<String>>,
}

impl Table {
    /// A table with these headings.
    pub fn new(headings: &[&str]) -> Self {
        Self {
            rows: vec![headings.iter().map(ToString::to_string).collect()],
        }
    }

    /// Adds a row.
    pub fn row(&mut self, cells: Vec<String>) {
        self.rows.push(cells);
    }

    /// Its lines.
    pub fn text(&self) -> String {
        let columns = self.rows.iter().map(Vec::len).max().unwrap_or(0);
        let width = |c: usize| {
            let cells = self.rows.iter().filter_map(|row| row.get(c));
            cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..columns).map(width).collect();
        let mut text = String::new();
        for row in &self.rows {
            let cells = row.iter().zip(&widths).enumerate();
            let line: Vec<String> = cells
                .map(|(c, (cell, &width))| match c {
                    0 => format!("{cell:width$}"),
                    _ => format!("{cell:>width$}"),
                })
                .collect();
            text += line.join("  ").trim_end();
            text.push('\n');
        }
        text
    }

    /// As comma-separated values; cells with commas, quotes or line breaks are quoted.
    pub fn csv(&self) -> String {
        let cell = |cell: &String| {
            if cell.contains([',', '"', '\n', '\r']) {
                format!("\"{}\"", cell.replace('"', "\"\""))
            } else {
                cell.clone()
            }
        };
        let line = |row: &Vec<String>| row.iter().map(cell).collect::<Vec<_>>().join(",") + "\n";
        self.rows.iter().map(line).collect()
    }
}

/// A number with as many digits as it deserves.
pub fn number(value: f64) -> String {
    match value.abs() {
        ..10.0 => format!("{value:.2}"),
        ..100.0 => format!("{value:.1}"),
        _ => format!("{value:.0}"),
    }
}

fn optional(value: Option<f64>) -> String {
    value.map_or("-".into(), number)
}

fn spread(spread: Spread) -> String {
    let Spread { median, min, max } = spread;
    format!("{} ({}..{})", number(median), number(min), number(max))
}

/// One line about the machine.
pub fn machine(machine: &Machine) -> String {
    let Machine {
        processor,
        processors,
        system,
        simd,
        threads,
        rayward,
        load,
    } = machine;
    let load = load.map_or(String::new(), |load| format!(", load {load} before"));
    format!(
        "rayward {rayward} with {simd} on {threads} of {processors} processors, {processor}, {system}{load}\n"
    )
}

/// Frames for people.
pub fn frames(report: &FramesReport) -> String {
    let embree = match report.embree.len() {
        0 => "not found".to_owned(),
        _ => report.embree.join(" and "),
    };
    let mut text = machine(&report.machine);
    text += &format!(
        "{}x{}, medians of {} runs in turns (smallest..largest), processor time; Embree: {embree}\n\
         rayward builds everything in every frame; what the others keep is built once and in no frame's time\n",
        report.width, report.height, report.runs
    );
    for frame in &report.frames {
        text.push('\n');
        text += &one_frame(frame);
    }
    text
}

fn one_frame(frame: &FrameReport) -> String {
    let mut text = format!(
        "{}, {} triangles, {}: {} eye rays, {} shadow rays\n",
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
    text += &table.text();
    if let (Some(ratio), Some(peer)) = (frame.ratio, &frame.best_peer) {
        text += &format!("rayward is {} times as fast as {peer}\n", number(ratio));
    }
    text
}

/// Frames as comma-separated values, one line a contender.
pub fn frames_csv(report: &FramesReport) -> String {
    let mut table = Table::new(&[
        "scene",
        "triangles",
        "frame",
        "contender",
        "threads",
        "eye_rays",
        "shadow_rays",
        "cpu_ms",
        "cpu_ms_min",
        "cpu_ms_max",
        "wall_ms",
        "mray_per_s",
        "over_rayward",
        "kept_build_ms",
        "differing_pixels",
        "same_picture",
    ]);
    for frame in &report.frames {
        for row in &frame.rows {
            let value = |value: Option<f64>| value.map_or(String::new(), |v| v.to_string());
            let cpu = row.times.map(|t| t.cpu_ms);
            table.row(vec![
                frame.scene.clone(),
                frame.triangles.to_string(),
                frame.frame.into(),
                row.contender.clone(),
                report.machine.threads.to_string(),
                frame.eye_rays.to_string(),
                frame.shadow_rays.to_string(),
                value(cpu.map(|t| t.median)),
                value(cpu.map(|t| t.min)),
                value(cpu.map(|t| t.max)),
                value(row.times.map(|t| t.wall_ms.median)),
                value(row.mray_per_s),
                value(row.over_rayward),
                value(row.kept_build_ms),
                row.differing_pixels.to_string(),
                row.same_picture.to_string(),
            ]);
        }
    }
    table.csv()
}

/// Curves for people.
pub fn scaling(report: &ScalingReport) -> String {
    let mut text = machine(&report.machine);
    text += &format!(
        "medians of {} runs (smallest..largest), everything built in every frame\n",
        report.runs
    );
    for curve in &report.curves {
        text += &format!("\n{} of {}, {}\n", curve.parameter, curve.scene, curve.frame);
        let mut table = Table::new(&[
            curve.parameter,
            "triangles",
            "resolution",
            "rays",
            "frame ms",
            "wall ms",
            "ns a ray",
        ]);
        for point in &curve.points {
            table.row(vec![
                point.value.to_string(),
                point.triangles.to_string(),
                format!("{}x{}", point.resolution[0], point.resolution[1]),
                point.rays.to_string(),
                spread(point.times.cpu_ms),
                spread(point.times.wall_ms),
                number(point.ns_per_ray),
            ]);
        }
        text += &table.text();
    }
    text
}

/// Curves as comma-separated values, one line a point.
pub fn scaling_csv(report: &ScalingReport) -> String {
    let mut table = Table::new(&[
        "parameter",
        "value",
        "scene",
        "frame",
        "triangles",
        "width",
        "height",
        "rays",
        "cpu_ms",
        "wall_ms",
        "ns_per_ray",
        "wall_ns_per_ray",
    ]);
    for curve in &report.curves {
        for point in &curve.points {
            table.row(vec![
                curve.parameter.into(),
                point.value.to_string(),
                curve.scene.clone(),
                curve.frame.into(),
                point.triangles.to_string(),
                point.resolution[0].to_string(),
                point.resolution[1].to_string(),
                point.rays.to_string(),
                point.times.cpu_ms.median.to_string(),
                point.times.wall_ms.median.to_string(),
                point.ns_per_ray.to_string(),
                point.wall_ns_per_ray.to_string(),
            ]);
        }
    }
    table.csv()
}

/// The pieces of work of a scene, with their names.
fn pieces(scene: &SceneBuilds) -> [(&'static str, &Scaled); 4] {
    [
        ("eye grid", &scene.eye_grid),
        ("binning of all", &scene.binning),
        ("hard shadows", &scene.shadows),
        ("frame eye+hard", &scene.frame),
    ]
}

/// Builds for people.
pub fn build(report: &BuildReport) -> String {
    let threads = report.machine.threads;
    let mut text = machine(&report.machine);
    text += &format!(
        "medians of {} runs in turns (smallest..largest); processor time on one thread, wall time on 1 and {threads}\n\n",
        report.runs
    );
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
    }
    text + &table.text()
}

/// Builds as comma-separated values, one line for each piece of work.
pub fn build_csv(report: &BuildReport) -> String {
    let mut table = Table::new(&[
        "scene",
        "triangles",
        "what",
        "threads",
        "cpu_ms",
        "mtriangles_per_s",
        "wall_ms",
        "wall_ms_parallel",
        "speed_up",
        "speed_up_of_fastest",
    ]);
    for scene in &report.scenes {
        for (what, scaled) in pieces(scene) {
            table.row(vec![
                scene.scene.clone(),
                scene.triangles.to_string(),
                what.into(),
                report.machine.threads.to_string(),
                scaled.cpu_ms.median.to_string(),
                scaled.mtriangles_per_s.to_string(),
                scaled.wall_ms.median.to_string(),
                scaled.wall_ms_parallel.median.to_string(),
                scaled.speed_up.to_string(),
                scaled.speed_up_of_fastest.to_string(),
            ]);
        }
    }
    table.csv()
}

/// The papers' tables for people.
pub fn tables(report: &TablesReport) -> String {
    let [width, height] = report.size;
    let mut text = machine(&report.machine);
    text += &format!(
        "medians of {} runs, wall time, everything of ours rebuilt in every frame; HM08's figures are of one core of 2006\n\n\
         HM08, Table 1, {width}x{height}\n",
        report.runs
    );
    text += &frame_lines(report).text();
    let mut table = Table::new(&[
        "scene",
        "frame",
        "fps",
        "x regular grid",
        "paper",
        "x hierarchy, rebuilt",
        "paper",
        "x hierarchy, prebuilt",
        "paper",
        "fastest hierarchy",
    ]);
    for line in &report.peers {
        let over = |other: Option<f64>| optional(other.map(|other| line.fps / other));
        let [grid, rebuilt, prebuilt] = line.paper_ratios.map(optional);
        table.row(vec![
            line.scene.clone(),
            line.frame.into(),
            number(line.fps),
            over(line.grid_fps),
            grid,
            over(line.rebuilt_fps),
            rebuilt,
            over(line.prebuilt_fps),
            prebuilt,
            line.fastest.clone().unwrap_or_else(|| "-".into()),
        ]);
    }
    text += &format!("\nHM08, Tables 2 and 3, square pictures\n{}", table.text());
    let raster = &report.raster;
    text += &format!(
        "\nHM08, Table 4, {}\n{} million triangles a second with {:.1} % of the window covered (paper: {}), {} million \
         vertices a second out of sight (paper: {})\n",
        raster.scene,
        number(raster.mtriangles_per_s[0]),
        raster.covered * 100.0,
        raster.mtriangles_per_s[1],
        number(raster.mvertices_per_s[0]),
        raster.mvertices_per_s[1]
    );
    text += &format!("\n{}\nHM08, claims\n", steps(&report.steps));
    for claim in &report.claims {
        let verdict = match claim.verdict {
            Verdict::Exceeded => "exceeded    ",
            Verdict::Reproduced => "reproduced  ",
            Verdict::Not => "NOT         ",
            Verdict::NotMeasured => "not measured",
        };
        text += &format!("{verdict}  {}: {}\n", claim.claim, claim.figures);
    }
    text
}

fn steps(report: &StepReport) -> String {
    let mut table = Table::new(&["grid", "cells", "cells a ray", "tests a ray", "references"]);
    for grid in &report.grids {
        let [x, y, z] = grid.cells;
        table.row(vec![
            if grid.perspective {
                "perspective"
            } else {
                "regular"
            }
            .into(),
            format!("{x}x{y}x{z}"),
            number(grid.steps),
            number(grid.tests),
            grid.references.to_string(),
        ]);
    }
    format!(
        "HM08, Table 5, {}, {} shadow rays, {:.0} % of them in shadow; the paper has 52.0 and 12.7\n{}",
        report.scene,
        report.rays,
        report.in_shadow * 100.0,
        table.text()
    )
}

/// Table 1.
fn frame_lines(report: &TablesReport) -> Table {
    let threads = format!("fps, {} threads", report.machine.threads);
    let mut table = Table::new(&[
        "scene",
        "stands for",
        "triangles",
        "frame",
        "fps",
        "paper",
        "x paper",
        &threads,
        "Mray/s",
        "paper",
        "build %",
        "paper",
    ]);
    for line in &report.frames {
        table.row(vec![
            line.scene.clone(),
            format!("{}, {}k", line.paper_scene, line.paper_ktriangles),
            line.triangles.to_string(),
            line.frame.into(),
            number(line.fps),
            number(line.paper_fps),
            number(line.fps / line.paper_fps),
            number(line.fps_parallel),
            number(line.mray_per_s),
            number(line.paper_mray_per_s),
            number(line.build * 100.0),
            number(line.paper_build * 100.0),
        ]);
    }
    table
}

/// Table 1 as comma-separated values, one line a frame.
pub fn tables_csv(report: &TablesReport) -> String {
    frame_lines(report).csv()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_aligned_and_cells_quoted() {
        let mut table = Table::new(&["name", "n"]);
        table.row(vec!["a, \"b\"".into(), "10".into()]);
        assert_eq!(table.text(), "name     n\na, \"b\"  10\n");
        assert_eq!(table.csv(), "name,n\n\"a, \"\"b\"\"\",10\n");
    }

    #[test]
    fn numbers_have_three_digits() {
        assert_eq!([1.234, 12.34, 123.4].map(number), ["1.23", "12.3", "123"]);
    }
}
