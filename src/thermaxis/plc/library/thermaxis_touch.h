/* thermaxis_touch: what touches of the machine's own probe add, beside thermaxis_lib.
 * The same text for every machine; only a model block with touches calls it. It needs sqrt of the
 * C library. */
#ifndef THERMAXIS_TOUCH_H
#define THERMAXIS_TOUCH_H

#include "thermaxis_lib.h"

#ifdef __cplusplus
extern "C" {
#endif

#define TX_MOST_NOTED 64

/* What became of the last touch; 0: there was none yet. */
enum {
    TX_BELIEVED = 1,
    TX_CONFIRMED = 2,
    TX_EXCLUDED = 3,
    TX_UNTIMELY = 5,
    TX_UNUSABLE = 6,
    TX_NO_EFFECT = 8,
    TX_TOO_FAR = 9,
    TX_TOO_MANY_EXCLUDED = 10
};

typedef struct {
    bool touched; /* the output is touched */
    tx_number touch_um2; /* variance of a touch, and of what the model leaves anew */
    tx_number discrepancy_um2; /* that of what the model leaves anew alone */
    tx_number drift_um2_per_h; /* variance by which the offset drifts in an hour */
    tx_number start_um2; /* variance where nothing is known */
    tx_number gate; /* largest distance in standard deviations */
    tx_number gate_2; /* its square */
    tx_number ramp_um_per_h; /* steady drift that proves nothing */
    tx_number confirm_s; /* a second touch confirms the first within */
    tx_number largest_um; /* limit of the offset */
    tx_number rate_step_um; /* largest change in a cycle */
} tx_touch_rules;

typedef struct {
    tx_number value_um; /* tool point relative to workpiece, positive away */
    tx_number age_s; /* time since the touch */
    int16_t counter; /* another one with every touch */
    bool acts; /* the offset is added to the correction, else only shown */
} tx_probed;

/* What was known of an offset at a time. */
typedef struct {
    bool known;
    tx_number offset_um;
    tx_number variance_um2;
    tx_number since_s; /* so long ago */
} tx_belief;

/* Offset between touches of one output: a Kalman filter of one number. Another value of the
 * counter is a new touch, that of the first call is none. It refers to the model and the
 * correction of the call that stood at its time, of which the last 64 are kept, as long as the
 * control was seen to follow. A touch beyond the gate changes nothing and wants a second one; two
 * that agree are believed. Three more that were excluded than believed void what was known. Ten
 * more, touches that do not see the correction or with the wrong sign, and such as show half as
 * much again as the limit end at zero until reset acknowledges it.
 * Not protected: whether what was touched is where it was. A workpiece put in anew, a worn tool, a
 * datum that was set look like a drift, and are followed within limit and rate. */
typedef struct {
    tx_number offset_um; /* added to the correction */
    tx_number std_um; /* standard uncertainty of the tool point */
    tx_number evidence; /* that touches do not see the correction */
    tx_number shown_um; /* correction and model at the last touch that was believed */
    tx_belief belief; /* displacement that the model lacks */
    tx_belief waits; /* a touch that was excluded waits for a second one */
    int16_t excluded; /* touches that were excluded more than believed */
    int16_t why; /* outcome by which the offset is off */
    int16_t outcome; /* of the last touch */
    int16_t before; /* counter of the last call */
    int16_t place; /* newest of what was noted */
    int16_t filled; /* so many are known */
    bool off; /* the offset is off, and nobody has acknowledged it */
    bool noted; /* the last call has said what a touch should show */
    tx_number noted_um; /* its correction and model */
    tx_number ring[TX_MOST_NOTED]; /* correction and model of the last calls */
} tx_touch;

void tx_touch_step(tx_touch *touch, const tx_touch_rules *rules, const tx_begin *begin,
                   const tx_clock_rules *clock, const tx_probed *probed, bool anew, bool forget,
                   bool follows);

/* What a touch should show from now on; unusable where the model is. */
void tx_touch_note(tx_touch *touch, bool usable, tx_number correction_um, tx_number weight,
                   tx_number model_um);

#ifdef __cplusplus
}
#endif

#endif /* THERMAXIS_TOUCH_H */
