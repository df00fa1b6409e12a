/* thermaxis_touch: what touches of the machine's own probe add, see thermaxis_touch.h.
 * Compile with -ffp-contract=off: a product and a sum in one operation round otherwise. */
#include "thermaxis_touch.h"

#include <float.h>
#include <math.h>

#if !defined(FLT_EVAL_METHOD) || !(FLT_EVAL_METHOD == 0 || (FLT_EVAL_METHOD == 1 && !TX_REAL))
#error "this compiler does not compute in the type that is declared"
#endif
#ifdef __FAST_MATH__
#error "fast math changes the numbers of this program"
#endif

static const tx_number zero = 0.0F;
static const tx_number half = 0.5F;
static const tx_number one = 1.0F;
static const tx_number two = 2.0F;
static const tx_number hour_s = 3600.0F;
static const tx_number largest_value_um = 1.0E+04F;
static const tx_number largest_age_s = (tx_number)1.0E+30;
static const tx_number largest_evidence = 7.5F; /* of one touch */
static const tx_number trip_evidence = 15.0F; /* touches do not see the correction */
static const tx_number farthest = 1.5F; /* times the limit */
static const int16_t most_excluded = 3;
static const int16_t trip_excluded = 10;

static tx_number limited(tx_number value, tx_number largest)
{
    if (value > largest) {
        return largest;
    }
    return value < -largest ? -largest : value;
}

static tx_number size_of(tx_number value)
{
    return value < zero ? -value : value;
}

static tx_number root(tx_number value)
{
#if TX_REAL
    return sqrtf(value);
#else
    return sqrt(value);
#endif
}

/* Variance of what was known so long ago: it grows as that of a random walk. */
static tx_number grown_um2(const tx_touch_rules *rules, const tx_belief *belief, tx_number since_s)
{
    tx_number grown = zero;
    if (!belief->known) {
        return rules->start_um2;
    }
    if (since_s > zero) {
        grown = rules->drift_um2_per_h * since_s;
        grown = grown / hour_s;
    }
    grown = belief->variance_um2 + grown;
    return grown > rules->start_um2 ? rules->start_um2 : grown;
}

static bool agree(const tx_touch_rules *rules, tx_number away_um, tx_number sum_um2)
{
    const tx_number square = away_um * away_um;
    const tx_number largest = rules->gate_2 * sum_um2;
    return square <= largest;
}

/* What a touch says for touches that do not see the correction. */
static tx_number evidence_of(const tx_touch_rules *rules, tx_number away_um, tx_number sum_um2,
                             tx_number changed_um, tx_number since_s)
{
    tx_number reach_um = root(sum_um2);
    const tx_number twice_um = two * size_of(changed_um);
    reach_um = rules->gate * reach_um;
    reach_um = twice_um + reach_um;
    if (size_of(away_um) > reach_um) {
        return zero;
    }
    tx_number ramp = since_s / hour_s;
    ramp = rules->ramp_um_per_h * ramp;
    ramp = ramp * ramp;
    ramp = sum_um2 + ramp;
    tx_number ratio = half * changed_um;
    ratio = away_um - ratio;
    ratio = changed_um * ratio;
    ratio = ratio / ramp;
    return limited(ratio, largest_evidence);
}

static void forget_all(tx_touch *touch)
{
    touch->belief = (tx_belief){.known = false};
    touch->waits = (tx_belief){.known = false};
    touch->excluded = 0;
    touch->evidence = zero;
}

static int16_t ended(tx_touch *touch, int16_t why)
{
    forget_all(touch);
    touch->off = true;
    touch->why = why;
    return why;
}

/* Believes a touch, or not; returns what became of it. */
static int16_t believed(tx_touch *touch, const tx_touch_rules *rules, tx_number value_um,
                        tx_number now_um, tx_number back_s)
{
    const tx_number touched_um = value_um - now_um;
    tx_number since_s = touch->belief.since_s - back_s;
    tx_number known_um2 = grown_um2(rules, &touch->belief, since_s);
    tx_number known_um = touch->belief.offset_um;
    tx_number away_um = touched_um - known_um;
    tx_number sum_um2 = known_um2 + rules->touch_um2;
    int16_t outcome = TX_BELIEVED;
    if (touch->belief.known) {
        const tx_number changed_um = touch->shown_um - now_um;
        touch->evidence
            = touch->evidence + evidence_of(rules, away_um, sum_um2, changed_um, since_s);
        if (touch->evidence < zero) {
            touch->evidence = zero;
        }
    }
    if (touch->evidence >= trip_evidence) {
        return ended(touch, TX_NO_EFFECT);
    }
    if (!agree(rules, away_um, sum_um2)) {
        since_s = touch->waits.since_s - back_s;
        known_um2 = grown_um2(rules, &touch->waits, since_s);
        known_um = touch->waits.offset_um;
        away_um = touched_um - known_um;
        sum_um2 = known_um2 + rules->touch_um2;
        outcome = TX_CONFIRMED;
        if (!touch->waits.known || size_of(since_s) > rules->confirm_s
            || !agree(rules, away_um, sum_um2)) {
            touch->excluded++;
            if (touch->excluded >= trip_excluded) {
                return ended(touch, TX_TOO_MANY_EXCLUDED);
            }
            if (touch->excluded >= most_excluded) {
                touch->belief = (tx_belief){.known = false};
            }
            touch->waits = (tx_belief){true, touched_um, rules->touch_um2, back_s};
            return TX_EXCLUDED;
        }
    }
    const tx_number gain = known_um2 / sum_um2;
    const tx_number left = one - gain;
    const tx_number moved_um = gain * away_um;
    touch->belief = (tx_belief){true, known_um + moved_um, left * known_um2, back_s};
    touch->waits = (tx_belief){.known = false};
    touch->excluded = touch->excluded > 0 ? (int16_t)(touch->excluded - 1) : 0;
    touch->shown_um = now_um;
    const tx_number farthest_um = farthest * rules->largest_um;
    return size_of(touch->belief.offset_um) > farthest_um ? ended(touch, TX_TOO_FAR) : outcome;
}

/* What stands in the ring for a touch of such an age. */
static int16_t looked_at(tx_touch *touch, const tx_touch_rules *rules, const tx_clock_rules *clock,
                         const tx_probed *probed)
{
    int16_t back = 1;
    tx_number back_s = clock->cycle_s;
    while (back <= touch->filled && probed->age_s > back_s) {
        back++;
        back_s = back_s + clock->cycle_s;
    }
    if (!(probed->value_um >= -largest_value_um && probed->value_um <= largest_value_um
          && probed->age_s >= zero && probed->age_s <= largest_age_s)) {
        return TX_UNUSABLE;
    }
    if (back > touch->filled) {
        return TX_UNTIMELY;
    }
    if (touch->off) {
        return touch->why;
    }
    int16_t slot = (int16_t)(touch->place + 1 - back);
    if (slot < 0) {
        slot = (int16_t)(slot + TX_MOST_NOTED);
    }
    return believed(touch, rules, probed->value_um, touch->ring[slot], back_s);
}

void tx_touch_step(tx_touch *touch, const tx_touch_rules *rules, const tx_begin *begin,
                   const tx_clock_rules *clock, const tx_probed *probed, bool anew, bool forget,
                   bool follows)
{
    if (touch->noted) {
        touch->place = touch->place + 1 < TX_MOST_NOTED ? (int16_t)(touch->place + 1) : 0;
        touch->ring[touch->place] = touch->noted_um;
        if (touch->filled < TX_MOST_NOTED) {
            touch->filled++;
        }
    }
    if (!touch->noted || anew || !follows) {
        touch->filled = 0;
    }
    if (begin->passed) {
        touch->belief.since_s = touch->belief.since_s + begin->elapsed_s;
        touch->waits.since_s = touch->waits.since_s + begin->elapsed_s;
    }
    if (anew || (forget && touch->off)) {
        forget_all(touch);
    }
    if (forget) {
        touch->off = false;
    }
    if (begin->first) {
        touch->before = probed->counter;
    }
    if (probed->counter != touch->before) {
        touch->before = probed->counter;
        touch->outcome = looked_at(touch, rules, clock, probed);
    }
    /* What is added: minus what is believed, within its limit, as fast as its rate allows. */
    tx_number new_um = probed->acts ? limited(-touch->belief.offset_um, rules->largest_um) : zero;
    if (begin->passed) {
        const tx_number highest_um = touch->offset_um + rules->rate_step_um;
        const tx_number lowest_um = touch->offset_um - rules->rate_step_um;
        new_um = new_um > highest_um ? highest_um : new_um;
        touch->offset_um = new_um < lowest_um ? lowest_um : new_um;
    }
    const tx_number now_um2 = grown_um2(rules, &touch->belief, touch->belief.since_s);
    const tx_number whole_um2 = now_um2 + rules->discrepancy_um2;
    touch->std_um = root(whole_um2);
}

void tx_touch_note(tx_touch *touch, bool usable, tx_number correction_um, tx_number weight,
                   tx_number model_um)
{
    const tx_number weighted_um = weight * model_um;
    touch->noted = usable;
    touch->noted_um = correction_um + weighted_um;
}
