//! How the benches of this package begin: on one thread, with words for what to measure, and a GPU if there is one.

use rayward_gpu::{Error, Gpu};

/// What a bench was started with.
pub(crate) struct Start {
    /// Whether it is run as a test, to do little.
    pub(crate) test: bool,
    /// Words that are no options and no numbers.
    pub(crate) names: Vec<String>,
    /// The first number among the words.
    pub(crate) count: Option<usize>,
    pub(crate) gpu: Result<Gpu, Error>,
}

/// Reads the command line, keeps all work on one thread, opens the GPU and says which one it is.
pub(crate) fn start() -> Start {
    rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build_global()
        .expect("one pool");
    let words: Vec<String> = std::env::args().skip(1).collect();
    let gpu = Gpu::open(None);
    match &gpu {
        Ok(gpu) => println!("GPU: {}, {}", gpu.adapter().name, gpu.adapter().driver),
        Err(problem) => println!("GPU: {problem}"),
    }
    Start {
        test: !words.iter().any(|word| word == "--bench"),
        count: words.iter().find_map(|word| word.parse().ok()),
        names: words
            .into_iter()
            .filter(|word| !word.starts_with('-') && word.parse::<usize>().is_err())
            .collect(),
        gpu,
    }
}
