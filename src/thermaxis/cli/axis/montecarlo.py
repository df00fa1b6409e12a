"""Show the scatter of differences by Monte Carlo, equation (10) of the method."""

import argparse
from pathlib import Path

from thermaxis import __version__, report
from thermaxis.cli._arguments import add_json, adder
from thermaxis.cli._json import show
from thermaxis.cli._progress import Progress
from thermaxis.positioning import DifferenceMonteCarlo, RatioEstimate, montecarlo_difference
from thermaxis.report.tables import Part, Section, Value, values_of, without_text


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    add = adder(parser)
    add("--samples N", "numbers in one sequence (default: the paper's 1000)", int, default=1000)
    add(
        "--repetitions N", "how often the experiment is repeated (default: 2000)", int, default=2000
    )
    add("--sigma-a S", "standard deviation of the first sequence (default: 1)", float, default=1.0)
    add("--sigma-b S", "standard deviation of the second sequence (default: as the first)", float)
    add("--seed N", "seed of the numbers (default: 2017)", int, default=2017)
    add_json(parser)
    add(
        "--figures DIR",
        "write the two distributions as figure_01_montecarlo (the paper's figure 1), PNG, SVG"
        " and CSV",
        Path,
    )


def run(arguments: argparse.Namespace) -> int:
    """Run the experiment and show its result."""
    with Progress() as progress:
        result = montecarlo_difference(
            samples=arguments.samples,
            repetitions=arguments.repetitions,
            sigma_a=arguments.sigma_a,
            sigma_b=arguments.sigma_b,
            seed=arguments.seed,
            on_progress=progress,
        )
    if arguments.figures is not None:
        report.write_montecarlo_figures(result, arguments.figures)
    show(described(result), arguments.json)
    return 0


def described(result: DifferenceMonteCarlo) -> list[Part]:
    """Return the experiment's result for terminal and JSON."""
    same = result.sigma_a == result.sigma_b
    sigmas = f"two sequences with sigma_a {result.sigma_a:g}, sigma_b {result.sigma_b:g}"
    allowed = result.one_sequence.allows(result.paper_ratio)
    caution = "" if result.samples == 1000 else f", here with {result.samples} numbers"
    return [
        "How much more does a difference scatter than the readings it is made of?",
        (
            f"{result.repetitions} experiments with {result.samples} normal random numbers each,"
            f" seed {result.seed}"
        ),
        *values_of(result, "samples", "repetitions", "seed", "sigma_a", "sigma_b"),
        _ratio(
            "one_sequence",
            "s_b / s_a for the differences of neighbours in one sequence, b_k = a_k - a_(k+1)",
            result,
        ),
        _ratio(
            "two_sequences", "s_(a-b) / s_a for two independent sequences" if same else "", result
        ),
        _ratio(
            "to_larger",
            "" if same else f"s_(a-b) over the larger s, {sigmas} (below 1.4142)",
            result,
        ),
        _ratio(
            "to_smaller",
            "" if same else f"s_(a-b) over the smaller s, {sigmas} (above 1.4142)",
            result,
        ),
        (
            f"The paper's {result.paper_ratio} from 1000 numbers lies"
            f" {'inside' if allowed else 'outside'} the interval of single experiments in one"
            f" sequence{caution}."
        ),
        Value("paper_ratio", result.paper_ratio),
        Value("paper_ratio_allowed", allowed),
        Value("histogram.edges", result.histogram_edges),
        Value("histogram.source", result.source_counts),
        Value("histogram.derived", result.derived_counts),
        Value("version", __version__),
    ]


def _ratio(key: str, title: str, result: DifferenceMonteCarlo) -> Section:
    """Return one ratio; without a title for the JSON alone."""
    estimate: RatioEstimate = getattr(result, key)
    low, high = estimate.mean_interval
    agreement = "with" if low <= estimate.expected <= high else "without"
    # in short sequences the first order of 1/n does not suffice for a verdict
    verdict = f", {agreement} the expected value" if result.samples >= 100 else ""
    values = [
        Value("theory", estimate.theory, "theory, equation (10)", ".4f"),
        Value("expected", estimate.expected, "expected at this length", ".4f"),
        Value("mean", estimate.mean, "mean of all experiments", ".4f"),
        Value("mean_interval", list(estimate.mean_interval), f"95 % confidence{verdict}", ".4f"),
        Value("first", estimate.first, "the first experiment", ".4f"),
        Value("single_interval", list(estimate.single_interval), "95 % of experiments", ".4f"),
        Value("scatter", estimate.scatter, "their standard deviation", ".4f"),
    ]
    return Section(key, [title, *values] if title else without_text(*values))
