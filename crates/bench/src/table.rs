//! Tables, and reports as rows for spreadsheets.

use crate::build::{BuildReport, Scaled, SceneBuilds};
use crate::frames::FramesReport;
use crate::scaling::ScalingReport;
use crate::structures::StructuresReport;
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

    /// All rows, the headings first.
    pub fn rows(&self) -> &[Vec<String>] {
        &self.rows
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

pub(crate) fn optional(value: Option<f64>) -> String {
    value.map_or("-".into(), number)
}

pub(crate) fn spread(spread: Spread) -> String {
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
        pinned,
        rayward,
        load,
    } = machine;
    let load = load.map_or(String::new(), |load| format!(", load {load} before"));
    let pinned = if *pinned { ", pinned" } else { "" };
    format!(
        "rayward {rayward} with {simd} on {threads} of {processors} processors{pinned}, {processor}, {system}{load}\n"
    )
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
        "cells_per_ray",
        "tests_per_ray",
    ]);
    for curve in &report.curves {
        for point in &curve.points {
            let step = |i: usize| point.steps.map_or(String::new(), |steps| steps[i].to_string());
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
                step(0),
                step(1),
            ]);
        }
    }
    table.csv()
}

/// The pieces of work of a scene, with their names.
pub(crate) fn pieces(scene: &SceneBuilds) -> [(&'static str, &Scaled); 4] {
    [
        ("eye grid", &scene.eye_grid),
        ("binning of all", &scene.binning),
        ("hard shadows", &scene.shadows),
        ("frame eye+hard", &scene.frame),
    ]
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

/// Table 1.
pub(crate) fn frame_lines(report: &TablesReport) -> Table {
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

/// Structures as comma-separated values, one line for each class of rays of each.
pub fn structures_csv(report: &StructuresReport) -> String {
    let mut table = Table::new(&[
        "scene",
        "triangles",
        "class",
        "structure",
        "rays",
        "hits",
        "differing",
        "ns_per_ray",
        "nodes_per_ray",
        "tests_per_ray",
        "build_ms",
        "bytes",
    ]);
    let value = |value: Option<f64>| value.map_or(String::new(), |v| v.to_string());
    for scene in &report.scenes {
        for class in &scene.classes {
            for row in &class.rows {
                let built = scene.structures.iter().find(|built| built.name == row.structure);
                table.row(vec![
                    scene.scene.clone(),
                    scene.triangles.to_string(),
                    class.class.into(),
                    row.structure.clone(),
                    row.rays.to_string(),
                    row.hits.to_string(),
                    row.differing.to_string(),
                    value(row.ns_per_ray),
                    value(row.nodes_per_ray),
                    value(row.tests_per_ray),
                    value(built.map(|built| built.build_ms)),
                    built
                        .and_then(|built| built.bytes)
                        .map_or(String::new(), |bytes| bytes.to_string()),
                ]);
            }
        }
    }
    table.csv()
}

/// VMV07's Table 1.
pub(crate) fn cube_lines(report: &TablesReport) -> Table {
    let mut table = Table::new(&[
        "scene",
        "stands for",
        "triangles",
        "texels",
        "layers",
        "paper",
        "A, peeled",
        "A, swept",
        "paper",
        "B, exact",
        "B, planes",
        "B, bvh",
        "paper",
        "Mray",
        "MB",
        "planes wrong %",
        "cube map wrong %",
    ]);
    for line in &report.cubes {
        let paper = |i: usize| line.paper_ms.map_or("-".into(), |ms| number(ms[i]));
        table.row(vec![
            line.scene.clone(),
            format!("{}, {}k", line.paper_scene, line.paper_ktriangles),
            line.triangles.to_string(),
            line.resolution.to_string(),
            line.layers.into_iter().max().unwrap_or(0).to_string(),
            line.paper_layers.to_string(),
            number(line.peel_ms),
            number(line.build_ms),
            paper(0),
            number(line.trace_ms),
            number(line.planes_ms),
            number(line.bvh_ms),
            paper(1),
            number(line.rays as f64 / 1e6),
            number(line.bytes as f64 / 1e6),
            number(line.planes_wrong * 100.0),
            number(line.map_wrong * 100.0),
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
