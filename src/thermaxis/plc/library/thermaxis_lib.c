/* thermaxis_lib: fixed functions of a thermal compensation, see thermaxis_lib.h.
 * Compile with -ffp-contract=off: a product and a sum in one operation round otherwise. */
#include "thermaxis_lib.h"

#include <float.h>

#if !defined(FLT_EVAL_METHOD) || !(FLT_EVAL_METHOD == 0 || (FLT_EVAL_METHOD == 1 && !TX_REAL))
#error "this compiler does not compute in the type that is declared"
#endif
#ifdef __FAST_MATH__
#error "fast math changes the numbers of this program"
#endif

static const tx_number zero = 0.0F;
static const tx_number one = 1.0F;
static const tx_number largest_number = (tx_number)1.0E+30; /* more is no temperature */
static const tx_number largest_offset_um = 1.0E+06F;
static const tx_number largest_gap_s = (tx_number)1.0E+09;
static const tx_number witness_s = 3600.0F; /* average of a witness */
static const tx_number longest_rest = 6.0F; /* times frozen_s, beside a witness */
static const tx_number largest_unseen_k = 1.0E+06F;
static const int most_steps = 10; /* cycles of the model in a call */
static const tx_number largest_diameter_mm = 1.0E+05F;

static tx_number limited(tx_number value, tx_number largest)
{
    if (value > largest) {
        return largest;
    }
    return value < -largest ? -largest : value;
}

void tx_lag_start(tx_lag *lag, tx_number start_k)
{
    lag->x_k = start_k;
#if TX_REAL
    lag->lost_k = zero;
#endif
}

void tx_lag_step(tx_lag *lag, tx_number u_k, tx_number alpha)
{
    tx_number change_k = u_k - lag->x_k;
    change_k = alpha * change_k;
#if TX_REAL
    /* What the sum lost is kept and given back (Kahan). */
    change_k = change_k - lag->lost_k;
    tx_number sum_k = lag->x_k + change_k;
    lag->lost_k = sum_k - lag->x_k;
    lag->lost_k = lag->lost_k - change_k;
    lag->x_k = sum_k;
#else
    lag->x_k = lag->x_k + change_k;
#endif
}

void tx_begin_init(tx_begin *begin)
{
    *begin = (tx_begin){.waiting = true};
}

void tx_begin_step(tx_begin *begin, const tx_clock_rules *rules, tx_number cycle_time_s,
                   bool connected, bool all_read, int16_t state)
{
    begin->first = !begin->called;
    begin->called = true;
    begin->heartbeat = begin->heartbeat >= 32767 ? 0 : (int16_t)(begin->heartbeat + 1);
    begin->clock_ok = cycle_time_s >= rules->shortest_s && cycle_time_s <= rules->longest_s;
    begin->late = cycle_time_s > rules->longest_s;
    begin->gap = begin->timed && cycle_time_s > rules->gap_s;
    begin->elapsed_s = rules->cycle_s;
    if (begin->gap) {
        begin->clock_ok = true;
        begin->elapsed_s = cycle_time_s > largest_gap_s ? largest_gap_s : cycle_time_s;
    }
    begin->passed = begin->clock_ok && begin->timed;
    if (begin->clock_ok) {
        begin->timed = true;
    }
    /* In Off nobody writes, so anybody may have changed the offset. */
    if (!connected || state == TX_OFF || begin->gap) {
        begin->waiting = true;
    }
    begin->take_over = begin->waiting && connected && all_read;
    begin->linked = connected && (!begin->waiting || all_read);
    if (begin->linked) {
        begin->waiting = false;
    }
}

bool tx_is_offset(tx_number read_um)
{
    return read_um >= -largest_offset_um && read_um <= largest_offset_um;
}

void tx_read_back_step(tx_read_back *back, const tx_limits *limits, tx_number read_um,
                       bool read_ok, bool take_over, tx_number written_um, tx_number tolerance_um)
{
    back->in_force_um = take_over ? read_um : written_um;
    back->agrees = false;
    back->followed_um = zero;
    if (read_ok && tx_is_offset(read_um)) {
        tx_number difference_um = read_um - back->in_force_um;
        back->agrees = difference_um >= -tolerance_um && difference_um <= tolerance_um;
        tx_number goal_um = back->agrees ? zero : read_um;
        tx_number lowest_um = back->in_force_um > zero ? zero : back->in_force_um;
        tx_number highest_um = back->in_force_um > zero ? back->in_force_um : zero;
        if (goal_um < lowest_um) {
            goal_um = lowest_um;
        }
        if (goal_um > highest_um) {
            goal_um = highest_um;
        }
        back->followed_um = goal_um;
    }
    back->outside
        = !(back->in_force_um >= -limits->total_um && back->in_force_um <= limits->total_um);
    back->at_zero = back->in_force_um >= zero && back->in_force_um <= zero;
}

static bool cause_stands(const tx_asked_for *asked)
{
    switch (asked->fault) {
    case TX_DOUBLE_COMPENSATION:
        return asked->other_compensation;
    case TX_OFFSET_OUTSIDE:
        return asked->outside;
    case TX_READ_BACK_DIFFERS:
        return !asked->agrees || !asked->linked;
    default:
        return false;
    }
}

void tx_requests_step(tx_requests *requests, const tx_asked_for *asked, bool first,
                      tx_number diameter_mm, bool diameter_known)
{
    requests->refused = false;
    requests->forget = false;
    requests->acknowledged = false;
    requests->enabled_anew = false;
    requests->in_fault = asked->state == TX_FAULT;
    if (first) {
        requests->enable_before = asked->enable;
        requests->hold_before = asked->hold;
    }
    if (asked->reset && !requests->reset_before) {
        if (requests->in_fault && cause_stands(asked)) {
            requests->refused = true;
        } else {
            requests->forget = true;
            if (requests->in_fault) {
                requests->acknowledged = true;
                requests->in_fault = false;
                requests->enabled = false;
                requests->held = false;
            }
        }
    }
    if (asked->enable && !requests->enable_before) {
        if (requests->in_fault || asked->other_compensation || asked->outside) {
            requests->refused = true;
        } else if (!requests->enabled) {
            requests->enabled = true;
            requests->enabled_anew = true;
        }
    } else if (requests->enable_before && !asked->enable) {
        requests->enabled = false;
        requests->held = false;
    }
    if (asked->hold && requests->enabled && !requests->in_fault) {
        requests->held = true;
    } else if (asked->hold && !requests->hold_before) {
        requests->refused = true;
    } else if (requests->hold_before && !asked->hold) {
        requests->held = false;
    }
    requests->reset_before = asked->reset;
    requests->enable_before = asked->enable;
    requests->hold_before = asked->hold;
    if (!diameter_known) {
        requests->workpiece_known = false;
    } else if (diameter_mm >= zero && diameter_mm <= largest_diameter_mm) {
        requests->workpiece_mm = diameter_mm;
        requests->workpiece_known = true;
    } else {
        requests->refused = true;
    }
}

static void sensor_good(tx_sensor *sensor, const tx_begin *begin, tx_number value_c)
{
    sensor->usable = true;
    sensor->quality = 0;
    if (!sensor->known || value_c < sensor->good_c || value_c > sensor->good_c) {
        sensor->still_s = zero;
        sensor->start_known = sensor->mean_known;
        sensor->start_c = sensor->mean.x_k;
        sensor->gone = false;
    }
    sensor->known = true;
    sensor->good_c = value_c;
    sensor->dated = begin->timed;
    sensor->unseen_k = zero;
}

static void sensor_unread(tx_sensor *sensor, int16_t quality, tx_number rate_k)
{
    sensor->quality = quality;
    sensor->unseen_k = sensor->unseen_k + rate_k;
    if (sensor->unseen_k > largest_unseen_k) {
        sensor->unseen_k = largest_unseen_k;
    }
}

static void sensor_compared(tx_sensor *sensor, const tx_sensor_rules *rules, const tx_begin *begin,
                            tx_number value_c, tx_number rate_k, tx_number longest_s)
{
    tx_number moved_k = value_c - sensor->good_c;
    tx_number most_k = rules->step_k + rate_k;
    if (moved_k < zero) {
        moved_k = -moved_k;
    }
    most_k = most_k + sensor->unseen_k;
    if (moved_k <= zero && rules->frozen_s > zero && sensor->still_s > longest_s) {
        sensor->quality = 8;
    } else if (moved_k <= zero || moved_k <= rules->step_k || moved_k <= most_k) {
        sensor_good(sensor, begin, value_c);
    } else {
        /* Too far: waiting allows no more than twice the step. */
        sensor->quality = 7;
        most_k = rules->step_k + rules->step_k;
        if (sensor->unseen_k > most_k) {
            most_k = sensor->unseen_k;
        }
        sensor->unseen_k = sensor->unseen_k + rate_k;
        if (sensor->unseen_k > most_k) {
            sensor->unseen_k = most_k;
        }
    }
}

/* Returns for how long a value may stand. */
static tx_number longest_stand(tx_sensor *sensor, const tx_sensor_rules sensor_rules[],
                               const tx_sensor_rules *rules, const tx_sensor *witness,
                               const tx_begin *begin)
{
    if (!witness->known) {
        return rules->frozen_s;
    }
    tx_number lately_s = sensor_rules[rules->witness].frozen_s;
    if (lately_s > witness_s) {
        lately_s = witness_s;
    }
    if (!sensor->mean_known) {
        sensor->mean_known = true;
        tx_lag_start(&sensor->mean, witness->good_c);
    } else if (begin->passed) {
        tx_lag_step(&sensor->mean, witness->good_c,
                    begin->elapsed_s / (witness_s + begin->elapsed_s));
    }
    tx_number away_k = sensor->mean.x_k - sensor->start_c;
    if (!sensor->start_known) {
        sensor->start_known = true;
        sensor->start_c = sensor->mean.x_k;
    } else if (away_k > rules->rests_k || away_k < -rules->rests_k) {
        sensor->gone = true;
    }
    bool alive = witness->usable || (witness->dated && witness->still_s <= lately_s);
    return alive && !sensor->gone ? longest_rest * rules->frozen_s : rules->frozen_s;
}

void tx_sensor_begin(tx_sensor *sensor, const tx_sensor_rules *rules, const tx_begin *begin,
                     bool forget)
{
    if (forget) {
        sensor->known = false;
        sensor->mean_known = false;
    }
    if (begin->passed && !begin->gap && sensor->dated
        && sensor->still_s <= longest_rest * rules->frozen_s) {
        sensor->still_s = sensor->still_s + begin->elapsed_s;
    }
}

void tx_sensor_step(tx_sensor sensors[], const tx_sensor_rules sensor_rules[], int k,
                    const tx_begin *begin, tx_number longest_hold_s, tx_number value_c, bool is_ok)
{
    tx_sensor *sensor = &sensors[k];
    const tx_sensor_rules *rules = &sensor_rules[k];
    tx_number rate_k = begin->passed ? rules->rate_k_per_s * begin->elapsed_s : zero;
    tx_number longest_s = rules->frozen_s;
    if (rules->witness >= 0) {
        longest_s = longest_stand(sensor, sensor_rules, rules, &sensors[rules->witness], begin);
    }
    sensor->usable = false;
    if (!(value_c >= -largest_number && value_c <= largest_number)) {
        sensor_unread(sensor, 2, rate_k);
    } else if (!is_ok) {
        sensor_unread(sensor, 3, rate_k);
    } else if (value_c < rules->lowest_c || value_c > rules->highest_c) {
        sensor_unread(sensor, 6, rate_k);
    } else if (!sensor->known) {
        sensor_good(sensor, begin, value_c);
    } else {
        sensor_compared(sensor, rules, begin, value_c, rate_k, longest_s);
    }
    /* What the model gets. */
    sensor->held = false;
    sensor->failed = false;
    if (begin->clock_ok && sensor->usable) {
        sensor->held_c = value_c;
        sensor->held_known = true;
        sensor->age_s = zero;
    } else if (begin->clock_ok) {
        sensor->held = true;
        if (sensor->age_s <= longest_hold_s) {
            sensor->age_s = sensor->age_s + begin->elapsed_s;
        }
        sensor->failed = !sensor->held_known || sensor->age_s > longest_hold_s;
    }
}

void tx_model_state_step(tx_model_state *model, const tx_begin *begin, const tx_clock_rules *rules,
                         tx_number cycle_time_s, bool held, bool failed)
{
    const bool clock_ok = begin->clock_ok;
    const bool anew = clock_ok && (begin->gap || !model->runs);
    model->started = anew && !failed;
    model->at_rest = model->started && !model->runs;
    model->refers = model->started && !model->referred;
    model->referred = model->referred || model->started;
    model->runs = model->started || (model->runs && !anew);
    model->advance = clock_ok && model->runs;
    model->steady = !anew;
    model->steps = 1;
    model->outcome_word = 0;
    if (!clock_ok) {
        if (cycle_time_s > zero) {
            model->behind_s = model->behind_s + cycle_time_s;
            model->behind_s = limited(model->behind_s, rules->gap_s);
        }
        model->outcome_word = TX_CLOCK_UNUSABLE;
    } else if (!model->runs) {
        model->outcome_word = TX_WAITING;
    } else if (model->started) {
        model->outcome_word = model->at_rest ? TX_STARTED : TX_GAP;
        model->behind_s = zero;
    }
    if (model->advance) {
        for (int turn = 1; turn < most_steps; turn++) {
            if (model->whole && model->behind_s >= rules->cycle_s) {
                model->behind_s = model->behind_s - rules->cycle_s;
                model->steps++;
            }
        }
        model->behind = model->behind_s >= rules->cycle_s;
        if (model->behind) {
            model->outcome_word |= TX_CLOCK_UNUSABLE;
        }
        model->whole = !held;
    }
    if (failed) {
        model->outcome_word |= TX_INPUT_FAILED;
    } else if (held) {
        model->outcome_word |= TX_INPUT_HELD;
    }
    model->quality = held ? TX_HELD : TX_GOOD;
    if (!clock_ok || failed) {
        model->quality = TX_BAD;
    }
}

void tx_asked_step(tx_asked *asked, const tx_limits *limits, tx_number model_um,
                   tx_number farthest_k, tx_number margin_k, tx_number lowest_weight)
{
    asked->weight = one;
    if (farthest_k > zero) {
        asked->weight = farthest_k / margin_k;
        asked->weight = one - asked->weight;
        if (asked->weight < lowest_weight) {
            asked->weight = lowest_weight;
        }
    }
    asked->asked_um = asked->weight * model_um;
    asked->asked_um = -asked->asked_um;
    asked->at_limit
        = asked->asked_um > limits->largest_um || asked->asked_um < -limits->largest_um;
    asked->asked_um = limited(asked->asked_um, limits->largest_um);
}

/* Counts a time, no further than beyond its limit. */
static tx_number counted(tx_number time_s, bool on, tx_number elapsed_s, tx_number limit_s)
{
    if (!on) {
        return zero;
    }
    return time_s <= limit_s ? time_s + elapsed_s : time_s;
}

/* The same, to the limit. */
static tx_number counted_to(tx_number time_s, bool on, tx_number elapsed_s, tx_number limit_s)
{
    tx_number after_s = on ? time_s + elapsed_s : zero;
    return on && after_s > limit_s ? limit_s : after_s;
}

/* The same, but never beyond the limit in the first cycle, however long that is. */
static tx_number counted_from_two(tx_number time_s, bool on, tx_number elapsed_s, tx_number limit_s)
{
    if (on && time_s <= zero && elapsed_s > limit_s) {
        return limit_s;
    }
    return counted(time_s, on, elapsed_s, limit_s);
}

static void count_times(tx_supervisor *s, const tx_supervisor_rules *rules, tx_number elapsed_s,
                        const tx_requests *requests, const tx_signals *signals)
{
    bool ready
        = signals->inputs_ok && signals->linked && signals->interlocks_met && signals->steady;
    bool differs = s->state != TX_OFF && signals->linked && !signals->agrees;
    bool at_limit = (s->state == TX_ACTIVE || s->state == TX_HOLDING) && signals->at_limit;
    bool halted = requests->enabled
        && (s->state == TX_WARMING || s->state == TX_HOLDING || s->state == TX_FADING);
    s->running_s = counted_to(s->running_s, signals->steady, elapsed_s, rules->settle_s);
    s->ready_s = counted_to(s->ready_s, ready, elapsed_s, rules->recovery_delay_s);
    s->input_lost_s = counted(s->input_lost_s, !signals->inputs_ok, elapsed_s, rules->lost_input_s);
    s->connection_lost_s
        = counted(s->connection_lost_s, !signals->linked, elapsed_s, rules->hold_connection_s);
    s->interlock_open_s = counted(s->interlock_open_s, !signals->interlocks_met, elapsed_s,
                                  rules->hold_interlock_s);
    s->held_s = counted(s->held_s, requests->held, elapsed_s, rules->hold_operator_s);
    s->differs_s = counted_from_two(s->differs_s, differs, elapsed_s, rules->read_back_s);
    s->at_limit_s = counted_from_two(s->at_limit_s, at_limit, elapsed_s, rules->at_limit_s);
    s->halted_s = counted(s->halted_s, halted, elapsed_s, rules->max_hold_s);
}

/* Returns the reasons that keep it from being active, and whether they have lasted too long. */
static int16_t blocked_by(const tx_supervisor *s, const tx_supervisor_rules *rules, bool held,
                          bool *expired)
{
    int16_t blocked = 0;
    *expired = s->halted_s > rules->max_hold_s;
    if (s->connection_lost_s > zero) {
        blocked |= TX_CONNECTION_LOST;
        *expired = *expired || s->connection_lost_s > rules->hold_connection_s;
    }
    if (s->interlock_open_s > zero) {
        blocked |= TX_INTERLOCK_OPEN;
        *expired = *expired || s->interlock_open_s > rules->hold_interlock_s;
    }
    if (s->input_lost_s > rules->input_timeout_s) {
        blocked |= TX_INPUT_BAD;
        *expired = *expired || s->input_lost_s > rules->lost_input_s;
    }
    if (s->running_s < rules->settle_s) {
        blocked |= TX_SETTLING;
    }
    if (held && s->held_s > rules->hold_operator_s) {
        blocked |= TX_HOLD_EXPIRED;
        *expired = true;
    } else if (held) {
        blocked |= TX_OPERATOR_HOLD;
    }
    return blocked;
}

static int16_t fault_of(const tx_supervisor *s, const tx_supervisor_rules *rules,
                        const tx_signals *signals)
{
    if (signals->other_compensation) {
        return TX_DOUBLE_COMPENSATION;
    }
    if (s->differs_s > rules->read_back_s) {
        return TX_READ_BACK_DIFFERS;
    }
    if (signals->outside) {
        return TX_OFFSET_OUTSIDE;
    }
    return s->at_limit_s > rules->at_limit_s ? TX_LONG_AT_LIMIT : 0;
}

static tx_motion motion_of(const tx_supervisor *s, const tx_signals *signals)
{
    if (s->state == TX_ACTIVE) {
        return signals->agrees && signals->model_quality != TX_BAD ? TX_FOLLOW : TX_STAY;
    }
    if (s->state < TX_FADING) {
        return TX_STAY;
    }
    if (signals->agrees || !signals->linked) {
        return TX_TO_ZERO;
    }
    return s->state == TX_FAULT ? TX_TO_ZERO_AS_FOLLOWED : TX_STAY;
}

void tx_supervisor_step(tx_supervisor *s, const tx_supervisor_rules *rules, tx_number elapsed_s,
                        const tx_requests *requests, const tx_signals *signals)
{
    bool expired = false;
    bool known_zero = signals->at_zero && signals->linked;
    if (requests->acknowledged) {
        s->state = TX_FADING;
        s->fault = 0;
        s->differs_s = zero;
    }
    if (requests->enabled_anew) {
        s->ready_s = zero;
    }
    count_times(s, rules, elapsed_s, requests, signals);
    int16_t blocked = blocked_by(s, rules, requests->held, &expired);
    /* A fault stays until it is acknowledged. */
    if (s->state != TX_OFF && s->state != TX_FAULT) {
        s->fault = fault_of(s, rules, signals);
        if (s->fault != 0) {
            s->state = TX_FAULT;
        }
    }
    if (s->state == TX_FAULT) {
        s->fault_word = s->fault;
    } else if (!requests->enabled) {
        s->state = known_zero || s->state == TX_OFF ? TX_OFF : TX_FADING;
        s->fault_word = TX_DISABLED;
    } else {
        bool all_there = s->state == TX_ACTIVE || s->ready_s >= rules->recovery_delay_s;
        if (s->state == TX_OFF) {
            s->state = TX_WARMING;
        } else if (blocked == 0 && all_there) {
            s->state = TX_ACTIVE;
        } else if (s->state == TX_FADING) {
            s->state = known_zero ? TX_WARMING : TX_FADING;
        } else if (expired && !(signals->at_zero && s->state == TX_WARMING)) {
            s->state = TX_FADING;
        } else if (s->state == TX_ACTIVE) {
            s->state = TX_HOLDING;
        }
        s->fault_word = blocked == 0 ? TX_RECOVERING : blocked;
        if (s->state == TX_ACTIVE) {
            s->fault_word = 0;
        }
    }
    s->motion = motion_of(s, signals);
}

void tx_trim_step(tx_trim *trim, const tx_begin *begin, tx_number trim_um, bool in_fault,
                  tx_number largest_um, tx_number longest_s)
{
    bool is_number = trim_um >= zero || trim_um < zero;
    bool changed
        = trim->odd || !is_number || trim_um < trim->before_um || trim_um > trim->before_um;
    trim->refused = false;
    if (begin->passed) {
        if (trim->left_s > begin->elapsed_s) {
            trim->left_s = trim->left_s - begin->elapsed_s;
        } else {
            trim->added_um = zero;
        }
    }
    if (changed && !begin->first) {
        if (trim_um >= zero && trim_um <= zero) {
            trim->added_um = zero;
        } else if (trim_um >= -largest_um && trim_um <= largest_um && longest_s > zero
                   && !in_fault) {
            trim->added_um = trim_um;
            trim->left_s = longest_s;
        } else {
            trim->refused = true;
        }
    }
    trim->odd = !is_number;
    if (is_number) {
        trim->before_um = trim_um;
    }
}

static tx_number moved(const tx_correction *correction, const tx_limits *limits,
                       const tx_read_back *back, bool passed)
{
    /* The total limit first, the rate last, so that nothing passes it. */
    tx_number after_um = limited(correction->goal_um, limits->total_um);
    tx_number highest_um = back->in_force_um;
    tx_number lowest_um = back->in_force_um;
    if (passed) {
        highest_um = back->in_force_um + limits->rate_step_um;
        lowest_um = back->in_force_um - limits->rate_step_um;
    }
    if (after_um > highest_um) {
        return highest_um;
    }
    return after_um < lowest_um ? lowest_um : after_um;
}

void tx_correction_step(tx_correction *correction, const tx_limits *limits, tx_number asked_um,
                        tx_number added_um, tx_motion motion, const tx_read_back *back, bool passed,
                        bool late)
{
    tx_number in_force_um = back->in_force_um;
    correction->wanted_um = limited(asked_um + added_um, limits->total_um);
    if (motion == TX_STAY) {
        correction->goal_um = in_force_um;
        correction->correction_um = in_force_um;
    } else {
        tx_number new_um = zero;
        if (motion == TX_FOLLOW) {
            new_um = correction->wanted_um;
        } else if (motion == TX_TO_ZERO_AS_FOLLOWED) {
            new_um = back->followed_um;
        }
        tx_number distance_um = new_um - correction->goal_um;
        if (limits->deadband_um <= zero || distance_um < -limits->deadband_um
            || distance_um > limits->deadband_um || (new_um >= zero && new_um <= zero)
            || (new_um >= in_force_um && new_um <= in_force_um)) {
            correction->goal_um = new_um;
        }
        passed = passed || (late && correction->goal_um >= zero && correction->goal_um <= zero);
        correction->correction_um = moved(correction, limits, back, passed);
    }
    correction->to_go_um = correction->wanted_um - correction->correction_um;
    if (correction->to_go_um < zero) {
        correction->to_go_um = -correction->to_go_um;
    }
    correction->near = correction->to_go_um <= limits->deadband_um + one;
}
