/* thermaxis_lib: fixed functions of a thermal compensation, in C99.
 *
 * The same text for every machine: what belongs to a model (gains, time constants, limits, names)
 * stands in the model block, which calls these functions once per cycle. Temperatures degC,
 * differences K, displacements and corrections um, times s. No allocation, no library.
 *
 * A struct that is kept over power-off begins anew by its input init. Compile with
 * -ffp-contract=off. The conditions are written so that a NaN never passes as plausible.
 */
#ifndef THERMAXIS_LIB_H
#define THERMAXIS_LIB_H

#include <stdbool.h>
#include <stdint.h>

#define TX_LIBRARY_VERSION 3
#define TX_REAL 0 /* 1: numbers are float */

#ifdef __cplusplus
extern "C" {
#endif

#if TX_REAL
typedef float tx_number;
#else
typedef double tx_number;
#endif

typedef enum { TX_OFF, TX_WARMING, TX_ACTIVE, TX_HOLDING, TX_FADING, TX_FAULT } tx_state;

/* What the corrections do. */
typedef enum { TX_STAY, TX_FOLLOW, TX_TO_ZERO, TX_TO_ZERO_AS_FOLLOWED } tx_motion;

enum { TX_GOOD, TX_HELD, TX_BAD };

/* Why it is not active: bits of fault_word. */
enum {
    TX_DISABLED = 1,
    TX_SETTLING = 2,
    TX_RECOVERING = 4,
    TX_INPUT_BAD = 8,
    TX_CONNECTION_LOST = 16,
    TX_INTERLOCK_OPEN = 32,
    TX_OPERATOR_HOLD = 64,
    TX_HOLD_EXPIRED = 128,
    TX_READ_BACK_DIFFERS = 256,
    TX_LONG_AT_LIMIT = 512,
    TX_DOUBLE_COMPENSATION = 1024,
    TX_OFFSET_OUTSIDE = 2048
};

/* What was out of the ordinary in the model: bits of outcome_word. */
enum {
    TX_STARTED = 1,
    TX_WAITING = 2,
    TX_CLOCK_UNUSABLE = 8,
    TX_GAP = 64,
    TX_INPUT_HELD = 128,
    TX_INPUT_FAILED = 256,
    TX_DIAMETER_HELD = 512,
    TX_OUTSIDE_VALIDITY = 2048
};

/* First-order lag, PT1: x moves towards u by alpha times the distance in every cycle. */
typedef struct {
    tx_number x_k;
#if TX_REAL
    tx_number lost_k; /* what the sum has added too much */
#endif
} tx_lag;

void tx_lag_start(tx_lag *lag, tx_number start_k);
void tx_lag_step(tx_lag *lag, tx_number u_k, tx_number alpha);

/* Begin of every cycle. A call that comes too early or too late advances nothing, but one too
 * late goes on towards zero; after a gap, longer than gap_s, the model starts anew. The offset
 * that stands in the control is taken over while the state is Off, after a gap and after a lost
 * connection; until it has been read nothing may be written. */
typedef struct {
    bool called;
    bool waiting; /* the offset in the control is still to be read */
    bool first; /* this is the first call */
    bool clock_ok; /* the call came in time, or after a gap */
    bool late; /* it came too late */
    bool gap; /* it came after a gap */
    bool passed; /* that time has passed since a good call */
    bool timed; /* some call came in time before or now */
    bool take_over; /* take the offset over that was read */
    bool linked; /* the corrections may be written */
    int16_t heartbeat; /* counts the calls to 32767, then from 0 */
    tx_number elapsed_s; /* time that counts: a cycle, or the gap */
} tx_begin;

typedef struct {
    tx_number cycle_s;
    tx_number shortest_s; /* shortest measured time that is accepted */
    tx_number longest_s; /* longest measured time that is accepted */
    tx_number gap_s; /* after a longer time the model starts anew */
} tx_clock_rules;

void tx_begin_init(tx_begin *begin);
void tx_begin_step(tx_begin *begin, const tx_clock_rules *rules, tx_number cycle_time_s,
                   bool connected, bool all_read, int16_t state);

/* Limits of one output. */
typedef struct {
    tx_number largest_um; /* output limit */
    tx_number total_um; /* total limit, with the trim */
    tx_number rate_step_um; /* largest change in a cycle */
    tx_number deadband_um; /* 0 for none */
    tx_number largest_trim_um;
} tx_limits;

/* Compares the offset that the control reports with the one that was written. After a fault the
 * correction goes to zero no further than the control is seen to follow, and never outward. */
typedef struct {
    tx_number in_force_um; /* correction in force */
    tx_number followed_um; /* how far a fault may go towards zero */
    bool agrees; /* the control reports it, within the tolerance */
    bool outside; /* it lies outside the total limit */
    bool at_zero;
} tx_read_back;

bool tx_is_offset(tx_number read_um);
void tx_read_back_step(tx_read_back *back, const tx_limits *limits, tx_number read_um,
                       bool read_ok, bool take_over, tx_number written_um,
                       tx_number tolerance_um);

/* Requests of the operator. reset, enable and disable are edges; a level that stands at the start
 * asks for nothing. hold is a level: while it is true, whatever is enabled and without a fault is
 * held. First reset, which acknowledges a fault whose cause is gone. */
typedef struct {
    bool reset_before;
    bool enable_before;
    bool hold_before;
    bool enabled;
    bool held;
    bool refused; /* a request of this call was refused */
    bool in_fault; /* still in the state Fault */
    bool forget; /* sensors take their present values as good */
    bool acknowledged; /* a fault was acknowledged in this call */
    bool enabled_anew; /* it was enabled in this call */
    bool workpiece_known;
    tx_number workpiece_mm; /* diameter in force */
} tx_requests;

typedef struct {
    bool enable;
    bool hold;
    bool reset;
    bool other_compensation;
    bool outside; /* a correction lies outside its total limit */
    bool agrees; /* the control reports what was written */
    bool linked;
    int16_t state;
    int16_t fault;
} tx_asked_for;

void tx_requests_step(tx_requests *requests, const tx_asked_for *asked, bool first,
                      tx_number diameter_mm, bool diameter_known);

/* One temperature. It is usable where it was read, its status is good, it is plausible, has not
 * jumped and is not frozen. While it could not be read it may have moved on at its rate. A value
 * that jumped is usable again where it comes back or the jump is acknowledged, never by waiting
 * alone. A value may stand for frozen_s, and six times as long beside a witness, a sensor that
 * moves with it, which is usable or has changed lately and whose average over an hour has gone no
 * further than rests_k since. A gap is not counted: nobody saw it stand. The model gets the last
 * usable value for the time that it may be held. */
typedef struct {
    tx_number lowest_c;
    tx_number highest_c;
    tx_number step_k; /* jump that is accepted at any rate */
    tx_number rate_k_per_s; /* fastest plausible change */
    tx_number frozen_s; /* longest time without any change, 0 for any */
    tx_number rests_k; /* so far a witness may go while this one stands */
    int16_t witness; /* its number, -1 for none */
} tx_sensor_rules;

typedef struct {
    bool known; /* some value was usable */
    bool dated; /* the time without a change counts */
    bool usable;
    bool held; /* the value for the model is not of this call */
    bool failed; /* it is too old, or there was none yet */
    bool held_known; /* the model has had a value */
    int16_t quality; /* 0 good, 2 missing, 3 status, 6 range, 7 jump, 8 frozen */
    tx_number good_c; /* last usable value */
    tx_number still_s; /* time without a change */
    tx_number unseen_k; /* how far it may have moved unseen */
    tx_number held_c; /* value for the model */
    tx_number age_s; /* its age */
    bool mean_known;
    bool start_known;
    bool gone; /* the witness has gone too far since this value changed */
    tx_lag mean; /* average of the witness */
    tx_number start_c; /* the same when this value changed last */
} tx_sensor;

/* Begins a call for every sensor, before any of them is looked at. */
void tx_sensor_begin(tx_sensor *sensor, const tx_sensor_rules *rules, const tx_begin *begin,
                     bool forget);

void tx_sensor_step(tx_sensor sensors[], const tx_sensor_rules rules[], int k,
                    const tx_begin *begin, tx_number longest_hold_s, tx_number value_c, bool is_ok);

/* Whether the model advances in this call: it waits until every temperature is there, starts, and
 * goes on with held temperatures; after a gap it starts anew at its steady state. The time of
 * calls that advance nothing is owed: while every temperature is read, at most ten cycles of the
 * model pass in a call until it is made up for. */
typedef struct {
    bool runs; /* it has started */
    bool advance; /* it advances in this call */
    bool started; /* it starts in this call */
    bool at_rest; /* it starts, and not at once after a gap */
    bool refers; /* it starts for the first time: these are its references */
    bool referred; /* it has its references */
    bool steady; /* it neither waits nor starts in this call */
    bool behind; /* a cycle or more is still owed */
    bool whole; /* every temperature was read when it advanced last */
    int16_t steps; /* so many cycles it advances */
    int16_t quality;
    int16_t outcome_word;
    tx_number behind_s; /* time that is owed */
} tx_model_state;

void tx_model_state_step(tx_model_state *model, const tx_begin *begin, const tx_clock_rules *rules,
                         tx_number cycle_time_s, bool held, bool failed);

/* What the model asks for: minus the displacement, weighted less outside the range of its
 * training, within the output limit. */
typedef struct {
    tx_number weight;
    tx_number asked_um;
    bool at_limit; /* the model asks for more than the output limit */
} tx_asked;

void tx_asked_step(tx_asked *asked, const tx_limits *limits, tx_number model_um,
                   tx_number farthest_k, tx_number margin_k, tx_number lowest_weight);

/* Decides when the machine is compensated, and what follows when something fails. Every time
 * counts from the first cycle of its condition. */
typedef struct {
    tx_number settle_s; /* the model settles for */
    tx_number recovery_delay_s; /* everything must be there for */
    tx_number input_timeout_s; /* a lost input is bridged for */
    tx_number lost_input_s; /* that and the hold that follows */
    tx_number hold_connection_s;
    tx_number hold_interlock_s;
    tx_number hold_operator_s;
    tx_number read_back_s; /* the read-back may differ for */
    tx_number at_limit_s; /* it may stand at the output limit for */
    tx_number max_hold_s; /* held at most, whatever comes */
} tx_supervisor_rules;

typedef struct {
    int16_t state;
    int16_t fault; /* reason of the state Fault */
    int16_t fault_word; /* sum of the reasons why it is not active */
    tx_motion motion;
    tx_number running_s; /* the model has run for */
    tx_number ready_s; /* everything has been there for */
    tx_number input_lost_s;
    tx_number connection_lost_s;
    tx_number interlock_open_s;
    tx_number held_s;
    tx_number differs_s;
    tx_number at_limit_s;
    tx_number halted_s; /* enabled and not active for */
} tx_supervisor;

typedef struct {
    bool inputs_ok; /* every temperature is usable, and a cycle has passed */
    bool steady; /* the model neither waits nor starts */
    bool linked;
    bool interlocks_met;
    bool agrees; /* the control reports what was written */
    bool at_limit; /* the model asks for more than an output limit */
    bool other_compensation;
    bool outside; /* a correction lies outside its total limit */
    bool at_zero; /* every correction is zero */
    int16_t model_quality;
} tx_signals;

void tx_supervisor_step(tx_supervisor *supervisor, const tx_supervisor_rules *rules,
                        tx_number elapsed_s, const tx_requests *requests,
                        const tx_signals *signals);

/* A bounded addition by a person. Every new value of the input is a request, that of the first
 * call is none. It expires. Zero takes it back in every state. */
typedef struct {
    tx_number added_um; /* trim in force */
    tx_number left_s; /* time until it expires */
    tx_number before_um; /* last value that was asked for */
    bool odd; /* the last value was no number */
    bool refused; /* a new trim was refused */
} tx_trim;

void tx_trim_step(tx_trim *trim, const tx_begin *begin, tx_number trim_um, bool in_fault,
                  tx_number largest_um, tx_number longest_s);

/* The correction of one output: what is asked for and the trim, within the total limit, as fast as
 * the rate allows and never faster. A goal stays until another one differs by more than the
 * deadband; zero and the correction in force are goals that no deadband keeps away. */
typedef struct {
    tx_number goal_um; /* where it goes */
    tx_number wanted_um; /* correction before motion and rate */
    tx_number correction_um; /* correction to be written */
    tx_number to_go_um; /* distance from what is wanted */
    bool near; /* it is no more than 1 um beyond the deadband */
} tx_correction;

void tx_correction_step(tx_correction *correction, const tx_limits *limits, tx_number asked_um,
                        tx_number added_um, tx_motion motion, const tx_read_back *back,
                        bool passed, bool late);

#ifdef __cplusplus
}
#endif

#endif /* THERMAXIS_LIB_H */
