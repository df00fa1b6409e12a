### What one sees first of an evaluated run: 20 lines of a terminal

summary-run = { $name }: { $kind } axis{ $axis }, { $targets } targets from { $first } to { $last } { $unit }, { $cycles } cycles { $approaches }, { $times ->
        [file] { DURATION($lasting_s) }
        [interpolated] { DURATION($lasting_s) } (times spread evenly{ $assumed ->
                [yes] , order assumed
               *[no] : see the remark
            })
        [order] no times, order { $assumed ->
                [yes] assumed (standard cycle)
               *[no] known
            }
       *[none] no times
    }

## Verdict and figures

summary-no_limits = verdict: none without limits; --limits FILE decides
summary-verdict = verdict: { $verdict ->
        [pass] PASS
        [fail] FAIL
       *[open] NOT DECIDED
    } by { $rule ->
        [simple] simple acceptance (guard band 0)
       *[iso14253-1] ISO 14253-1 (guard band U)
    }
summary-verdict_of = { summary-verdict }: { $figures }
summary-figure_A = accuracy
summary-figure_E = systematic { $edition ->
        [E2014] error
       *[older] deviation
    }
summary-figure_M = range of the mean
summary-figure_R = repeatability
summary-figure_B = reversal { $edition ->
        [E2014] error
       *[older] value
    }
summary-u = ± U: coverage 95.45 %
summary-u_doubted = ± U: may cover less than 95.45 % ({ $doubts })
summary-u_without = { $coverage }, without { $left_out }
summary-other_standard = { $name } ({ $mark }): { $figures } { $unit }

## Drift

summary-drift_linear = drift: { $found ->
        [yes] significant
       *[no] not significant
    } ({ $p }); thermal growth over the run { $growth } µm/m ({ $grown } µm over { $length } mm), shift at the mean position { $shift } µm
summary-drift_rotary = drift: { $found ->
        [yes] significant
       *[no] not significant
    } ({ $p }); change of scale over the run { $growth } arcsec per 1000° ({ $grown } arcsec over { $length }°), turn at the mean position { $shift } arcsec
summary-drift_swings = swing: the whole axis moved within { $swing } { $unit } in between
summary-drift_not_evaluated = drift: not evaluated

## Last line

summary-rest = More: { $findings ->
        [0] {""}
        [one] 1 finding,{" "}
       *[other] { $findings } findings,{" "}
    }{ $warnings ->
        [0] {""}
        [one] 1 warning,{" "}
       *[other] { $warnings } warnings,{" "}
    }all tables: --full-tables, or --json, --report
