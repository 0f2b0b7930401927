//! Plots, drawn by `plotters` as SVG.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// A plot.
#[derive(Clone, Debug, PartialEq)]
pub struct Plot {
    /// Name of its file, without its ending.
    pub name: String,
    /// What it shows.
    pub caption: String,
    /// What is drawn.
    pub kind: PlotKind,
}

/// What a plot is made of.
#[derive(Clone, Debug, PartialEq)]
pub enum PlotKind {
    /// Curves with logarithmic axes.
    Curves {
        /// What the axes are, across and upwards.
        axes: [String; 2],
        /// The curves.
        series: Vec<Series>,
    },
    /// Horizontal bars in groups, one of each series in every group.
    Bars {
        /// What their length is.
        axis: String,
        /// Names of the series.
        series: Vec<String>,
        /// The groups: a name, and the lengths; one that is not finite is left out.
        groups: Vec<(String, Vec<f64>)>,
        /// A length that a line marks.
        mark: Option<f64>,
    },
}

/// One curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Its name.
    pub name: String,
    /// Its points, by growing first coordinate. Those that are not above zero are left out.
    pub points: Vec<[f64; 2]>,
}

/// Width of all plots in pixels.
const WIDTH: u32 = 760;

/// Height of plots of curves.
const HEIGHT: u32 = 420;

/// Height of a bar.
const BAR: u32 = 15;

/// Room left of bars for their names.
const NAMES: u32 = 170;

type Drawn = Result<(), Box<dyn std::error::Error>>;

impl Plot {
    /// Whether there is something to draw.
    pub(crate) fn is_empty(&self) -> bool {
        match &self.kind {
            PlotKind::Curves { series, .. } => series.iter().all(|s| s.points.len() < 2),
            PlotKind::Bars { groups, .. } => groups.is_empty(),
        }
    }

    /// The plot as an SVG document.
    pub fn svg(&self) -> String {
        let mut svg = String::new();
        let drawn = match &self.kind {
            PlotKind::Curves { axes, series } => curves(&mut svg, axes, series),
            PlotKind::Bars {
                axis,
                series,
                groups,
                mark,
            } => bars(&mut svg, axis, series, groups, *mark),
        };
        drawn.expect("nothing fails that draws into a string");
        svg
    }
}

fn color(index: usize) -> RGBColor {
    const COLORS: [RGBColor; 7] = [
        RGBColor(31, 97, 171),
        RGBColor(214, 96, 20),
        RGBColor(28, 137, 72),
        RGBColor(176, 36, 71),
        RGBColor(116, 80, 163),
        RGBColor(122, 90, 50),
        RGBColor(90, 100, 110),
    ];
    COLORS[index % COLORS.len()]
}

fn short(value: f64) -> String {
    match value.abs() {
        1e6.. => format!("{}M", value / 1e6),
        1e3.. => format!("{}k", value / 1e3),
        _ => format!("{value}"),
    }
}

/// A range that holds all of these with some room.
fn range(values: impl Iterator<Item = f64>) -> std::ops::Range<f64> {
    let (low, high) = values.fold((f64::INFINITY, 0.0_f64), |(low, high), v| {
        (low.min(v), high.max(v))
    });
    low / 1.2..high * 1.25
}

fn curves(svg: &mut String, axes: &[String; 2], series: &[Series]) -> Drawn {
    let usable = |point: &&[f64; 2]| point.iter().all(|&v| v > 0.0 && v.is_finite());
    let all = || series.iter().flat_map(|s| s.points.iter().filter(usable));
    let root = SVGBackend::with_string(svg, (WIDTH, HEIGHT)).into_drawing_area();
    root.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&root)
        .margin(10)
        .x_label_area_size(44)
        .y_label_area_size(64)
        .build_cartesian_2d(
            range(all().map(|p| p[0])).log_scale(),
            range(all().map(|p| p[1])).log_scale(),
        )?;
    chart
        .configure_mesh()
        .max_light_lines(1)
        .light_line_style(WHITE)
        .bold_line_style(RGBColor(215, 215, 215))
        .x_desc(&axes[0])
        .y_desc(&axes[1])
        .x_label_formatter(&|v| short(*v))
        .y_label_formatter(&|v| short(*v))
        .label_style(("sans-serif", 13))
        .draw()?;
    for (index, one) in series.iter().enumerate() {
        let points = || one.points.iter().filter(usable).map(|p| (p[0], p[1]));
        chart
            .draw_series(LineSeries::new(points(), color(index).stroke_width(2)))?
            .label(&one.name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], color(index).stroke_width(2)));
        chart.draw_series(points().map(|point| Circle::new(point, 3, color(index).filled())))?;
    }
    chart
        .configure_series_labels()
        .background_style(WHITE.mix(0.85))
        .border_style(RGBColor(200, 200, 200))
        .label_font(("sans-serif", 13))
        .draw()?;
    root.present()?;
    Ok(())
}

fn bars(
    svg: &mut String,
    axis: &str,
    series: &[String],
    groups: &[(String, Vec<f64>)],
    mark: Option<f64>,
) -> Drawn {
    let rows = (series.len() as u32 + 1) * groups.len() as u32;
    let legend = 22;
    let root = SVGBackend::with_string(svg, (WIDTH, rows * BAR + 54 + legend)).into_drawing_area();
    root.fill(&WHITE)?;
    let font = ("sans-serif", 13).into_font();
    let left = TextStyle::from(font.clone()).pos(Pos::new(HPos::Left, VPos::Center));
    let right = TextStyle::from(font.clone()).pos(Pos::new(HPos::Right, VPos::Center));
    for (index, name) in series.iter().enumerate() {
        let x = NAMES as i32 + index as i32 * (WIDTH - NAMES) as i32 / series.len() as i32;
        root.draw(&Rectangle::new([(x, 6), (x + 12, 18)], color(index).filled()))?;
        root.draw(&Text::new(name.clone(), (x + 18, 12), left.clone()))?;
    }
    let lengths = groups.iter().flat_map(|(_, lengths)| lengths).copied();
    let longest = lengths.filter(|v| v.is_finite()).chain(mark).fold(0.0, f64::max);
    let mut chart = ChartBuilder::on(&root)
        .margin_top(legend + 2)
        .margin_right(16)
        .x_label_area_size(40)
        .y_label_area_size(NAMES)
        .build_cartesian_2d(0.0..longest.max(1e-9) * 1.1, f64::from(rows)..0.0)?;
    chart
        .configure_mesh()
        .disable_y_mesh()
        .y_labels(0)
        .light_line_style(WHITE)
        .bold_line_style(RGBColor(215, 215, 215))
        .x_desc(axis)
        .x_label_formatter(&|v| short(*v))
        .label_style(("sans-serif", 13))
        .draw()?;
    for (group, (name, lengths)) in groups.iter().enumerate() {
        let first = (group * (series.len() + 1)) as f64 + 0.5;
        let middle = first + series.len() as f64 / 2.0;
        let (x, y) = chart.backend_coord(&(0.0, middle));
        root.draw(&Text::new(name.clone(), (x - 8, y), right.clone()))?;
        for (index, &length) in lengths.iter().enumerate().filter(|(_, v)| v.is_finite()) {
            let top = first + index as f64;
            let corners = [(0.0, top + 0.08), (length, top + 0.92)];
            chart.draw_series([Rectangle::new(corners, color(index).filled())])?;
            let (x, y) = chart.backend_coord(&(length, top + 0.5));
            root.draw(&Text::new(crate::table::number(length), (x + 4, y), left.clone()))?;
        }
    }
    if let Some(mark) = mark {
        let line = [(mark, 0.0), (mark, f64::from(rows))];
        chart.draw_series([PathElement::new(line, BLACK.mix(0.6).stroke_width(1))])?;
    }
    root.present()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(kind: PlotKind) -> Plot {
        Plot {
            name: "p".into(),
            caption: "c".into(),
            kind,
        }
    }

    #[test]
    fn curves_and_bars_are_drawn_with_their_names() {
        let series = Series {
            name: "soft < hard".into(),
            points: vec![[1.0, 10.0], [100.0, 20.0], [1000.0, 0.0]],
        };
        let svg = plot(PlotKind::Curves {
            axes: ["triangles".into(), "ns a ray".into()],
            series: vec![series],
        })
        .svg();
        assert!(
            svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"),
            "{svg}"
        );
        assert!(
            svg.contains("soft &lt; hard") && svg.contains("ns a ray"),
            "{svg}"
        );
        assert_eq!(
            svg.matches("<circle").count(),
            2,
            "a point at zero has no logarithm"
        );
        let svg = plot(PlotKind::Bars {
            axis: "times".into(),
            series: vec!["eye".into(), "hard".into()],
            groups: vec![
                ("bunny".into(), vec![4.5, f64::NAN]),
                ("room".into(), vec![1.0, 2.0]),
            ],
            mark: Some(5.0),
        })
        .svg();
        assert!(svg.contains("bunny") && svg.contains("4.50"), "{svg}");
        let bars = svg.matches("<rect").count();
        assert_eq!(bars, 1 + 2 + 3, "the ground, two in the legend, three bars");
    }
}
