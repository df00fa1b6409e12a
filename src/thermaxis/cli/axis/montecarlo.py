"""``thermaxis montecarlo``: how much more a difference scatters than what it is made of."""

import argparse
import sys
from pathlib import Path

from thermaxis import __version__, report
from thermaxis.cli._json import write_json
from thermaxis.cli._progress import Progress
from thermaxis.positioning import DifferenceMonteCarlo, RatioEstimate, montecarlo_difference


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    add = parser.add_argument
    add(
        "--samples",
        metavar="N",
        type=int,
        default=1000,
        help="numbers in one sequence (default: the paper's 1000)",
    )
    add(
        "--repetitions",
        metavar="N",
        type=int,
        default=2000,
        help="how often the experiment is repeated (default: 2000)",
    )
    add(
        "--sigma-a",
        metavar="S",
        type=float,
        default=1.0,
        help="standard deviation of the first sequence (default: 1)",
    )
    add(
        "--sigma-b",
        metavar="S",
        type=float,
        help="standard deviation of the second sequence (default: as the first)",
    )
    add("--seed", metavar="N", type=int, default=2017, help="seed of the numbers (default: 2017)")
    add("--json", metavar="FILE|-", help="write the result as JSON; - for standard output alone")
    add("--figures", metavar="DIR", type=Path, help="write the two distributions as charts and CSV")


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
    if arguments.json is not None:
        write_json(as_json(result), arguments.json)
    if arguments.json != "-":
        sys.stdout.write(as_text(result))
    return 0


def _ratio_as_json(estimate: RatioEstimate) -> dict[str, object]:
    return {
        "theory": estimate.theory,
        "expected": estimate.expected,
        "first": estimate.first,
        "mean": estimate.mean,
        "mean_interval": list(estimate.mean_interval),
        "scatter": estimate.scatter,
        "single_interval": list(estimate.single_interval),
    }


def as_json(result: DifferenceMonteCarlo) -> dict[str, object]:
    """Return the result with the keys of the command's JSON."""
    return {
        "samples": result.samples,
        "repetitions": result.repetitions,
        "sigma_a": result.sigma_a,
        "sigma_b": result.sigma_b,
        "seed": result.seed,
        "one_sequence": _ratio_as_json(result.one_sequence),
        "two_sequences": _ratio_as_json(result.two_sequences),
        "to_larger": _ratio_as_json(result.to_larger),
        "to_smaller": _ratio_as_json(result.to_smaller),
        "paper_ratio": result.paper_ratio,
        "paper_ratio_allowed": result.one_sequence.allows(result.paper_ratio),
        "histogram": {
            "edges": result.histogram_edges.tolist(),
            "source": result.source_counts.tolist(),
            "derived": result.derived_counts.tolist(),
        },
        "version": __version__,
    }


def _paragraph(title: str, estimate: RatioEstimate, samples: int) -> str:
    low, high = estimate.mean_interval
    lowest, highest = estimate.single_interval
    agreement = "with" if low <= estimate.expected <= high else "without"
    # in short sequences the first order of 1/n does not suffice for a verdict
    verdict = f", {agreement} the expected value" if samples >= 100 else ""
    return (
        f"{title}\n"
        f"  theory, equation (10)      {estimate.theory:.4f}"
        f"  (long sequences; about {estimate.expected:.4f} expected at this length)\n"
        f"  mean of all experiments    {estimate.mean:.4f}"
        f"  (95 % confidence interval {low:.4f} to {high:.4f}{verdict})\n"
        f"  the first experiment       {estimate.first:.4f}\n"
        f"  95 % of single experiments {lowest:.4f} to {highest:.4f}"
        f"  (standard deviation {estimate.scatter:.4f})\n"
    )


def as_text(result: DifferenceMonteCarlo) -> str:
    """Return the result in words, for a terminal."""
    title = (
        "How much more does a difference scatter than the readings it is made of?\n"
        f"{result.repetitions} experiments with {result.samples} normal random numbers each,"
        f" seed {result.seed}\n"
    )
    parts = [
        title,
        _paragraph(
            "s_b / s_a for the differences of neighbours in one sequence, b_k = a_k - a_(k+1)",
            result.one_sequence,
            result.samples,
        ),
    ]
    if result.sigma_a == result.sigma_b:
        parts.append(
            _paragraph(
                "s_(a-b) / s_a for two independent sequences", result.two_sequences, result.samples
            )
        )
    else:
        sigmas = f"sigma_a {result.sigma_a:g}, sigma_b {result.sigma_b:g}"
        parts += [
            _paragraph(
                f"s_(a-b) over the larger s, two sequences with {sigmas} (below 1.4142)",
                result.to_larger,
                result.samples,
            ),
            _paragraph(
                f"s_(a-b) over the smaller s, two sequences with {sigmas} (above 1.4142)",
                result.to_smaller,
                result.samples,
            ),
        ]
    parts.append(
        f"The paper's {result.paper_ratio} from 1000 numbers "
        + _verdict(result.samples, allowed=result.one_sequence.allows(result.paper_ratio))
    )
    return "\n".join(parts)


def _verdict(samples: int, *, allowed: bool) -> str:
    place = "lies inside" if allowed else "lies outside"
    verdict = f"{place} the interval of single experiments in one sequence"
    caution = "" if samples == 1000 else f", here with {samples} numbers"
    return f"{verdict}{caution}.\n"
