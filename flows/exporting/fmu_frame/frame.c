/* FMI 2.0 co-simulation around one compiled function: the model, whose numbers stand in a block.

   No physics stands here. model.h, written for each vehicle, says how long the block is and which numbers of it are
   parameters, inputs and outputs, in this order; a value reference is a place in the block. */

#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "model.h"

#ifdef MUSYNC_HEADERS /* a test compiles this file against the standard's own headers */
#include "fmi2Functions.h"
#else
#if defined _WIN32
#define FMI2_Export __declspec(dllexport)
#else
#define FMI2_Export __attribute__((visibility("default")))
#endif
typedef void *fmi2Component, *fmi2ComponentEnvironment, *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer, fmi2Boolean;
typedef char fmi2Char, fmi2Byte;
typedef const fmi2Char *fmi2String;
enum { fmi2False, fmi2True };
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated } fmi2StatusKind;
typedef struct {
    void (*logger)(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String, ...);
    void *(*allocateMemory)(size_t, size_t);
    void (*freeMemory)(void *);
    void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
    fmi2ComponentEnvironment componentEnvironment;
} fmi2CallbackFunctions;
#endif

extern int64_t musync_advance(double *block, double *states, double *rows, int64_t steps);

enum { SETTING_UP, INITIALIZING, STEPPING };

typedef struct {
    double block[BLOCK], start_time;
    int phase;
} Drive;

typedef struct {
    Drive drive;
    double states[2 * STATE_WIDTH], rows[2 * OUTPUTS];
    const fmi2CallbackFunctions *callbacks;
    char *name;
} Instance;

static fmi2Status say(Instance *self, fmi2Status status, const char *format, ...)
{
    char text[300];
    va_list values;
    va_start(values, format);
    vsnprintf(text, sizeof text, format, values);
    va_end(values);
    if (self->callbacks && self->callbacks->logger) /* some simulators show the format itself; no text here has a % */
        self->callbacks->logger(self->callbacks->componentEnvironment, self->name, status, "logStatusError", text);
    return status;
}

static fmi2Status advance(Instance *self, int64_t steps)
{
    double *block = self->drive.block;
    int64_t done = musync_advance(block, self->states, self->rows, steps);
    if (done == NO_TYRE)
        return say(self, fmi2Error, "weather must be one in which the vehicle has a tyre family; it is %g",
                   block[WEATHER]);
    for (int i = 0; done == DONE && i < OUTPUTS; i++)
        if (!isfinite(block[INPUTS + i]))
            return say(self, fmi2Error, "the motion is not finite at %g s (%s): look at the inputs", block[TIME],
                       NAMES[INPUTS + i]);
    return done == DONE ? fmi2OK : say(self, fmi2Fatal, "the compiled model failed at %g s", block[TIME]);
}

static void reset(Drive *drive)
{
    memset(drive, 0, sizeof *drive);
    memcpy(drive->block, STARTS, sizeof STARTS);
}

static fmi2Status set(Instance *self, fmi2ValueReference place, double value)
{
    if (place >= INPUTS)
        return say(self, fmi2Error, "value reference %u: only parameters and inputs are set", place);
    if (place < PARAMETERS && self->drive.phase == STEPPING)
        return say(self, fmi2Error, "%s is a parameter: it is set before the start", NAMES[place]);
    if (!(value >= MINIMA[place] && value <= MAXIMA[place]) || !isfinite(value))
        return say(self, fmi2Error, "%s must be a number within %g to %g; it is %g", NAMES[place], MINIMA[place],
                   MAXIMA[place], value);
    self->drive.block[place] = value;
    return fmi2OK;
}

static fmi2Status get(Instance *self, fmi2ValueReference place, double *value)
{
    if (place >= INPUTS + OUTPUTS)
        return say(self, fmi2Error, "value reference %u: there are %d variables", place, INPUTS + OUTPUTS);
    if (place >= INPUTS && self->drive.phase != STEPPING) { /* outputs follow from what is set so far */
        fmi2Status status = advance(self, START);
        if (status != fmi2OK)
            return status;
    }
    *value = self->drive.block[place];
    return fmi2OK;
}

FMI2_Export const char *fmi2GetTypesPlatform(void) { return "default"; }
FMI2_Export const char *fmi2GetVersion(void) { return "2.0"; }

FMI2_Export fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[])
{
    (void)c, (void)on, (void)n, (void)categories;
    return fmi2OK;
}

FMI2_Export fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                          const fmi2CallbackFunctions *callbacks, fmi2Boolean visible,
                                          fmi2Boolean logging)
{
    (void)resources, (void)visible, (void)logging;
    Instance *self = calloc(1, sizeof *self);
    if (!self)
        return NULL;
    self->callbacks = callbacks;
    self->name = calloc(strlen(name ? name : "") + 1, 1);
    if (self->name)
        strcpy(self->name, name ? name : "");
    reset(&self->drive);
    if (self->name && type == fmi2CoSimulation && guid && !strcmp(guid, GUID))
        return self;
    say(self, fmi2Error, "this FMU is for co-simulation and has the guid %s", GUID);
    free(self->name);
    free(self);
    return NULL;
}

FMI2_Export void fmi2FreeInstance(fmi2Component c)
{
    Instance *self = c;
    if (self)
        free(self->name);
    free(self);
}

FMI2_Export fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance,
                                           fmi2Real start_time, fmi2Boolean has_stop, fmi2Real stop_time)
{
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop_time;
    ((Instance *)c)->drive.start_time = start_time;
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    ((Instance *)c)->drive.phase = INITIALIZING;
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    fmi2Status status = advance(c, START);
    if (status == fmi2OK)
        ((Instance *)c)->drive.phase = STEPPING;
    return status;
}

FMI2_Export fmi2Status fmi2Terminate(fmi2Component c)
{
    (void)c;
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2Reset(fmi2Component c)
{
    reset(&((Instance *)c)->drive);
    return fmi2OK;
}

#define GET(TYPE)                                                                                                      \
    FMI2_Export fmi2Status fmi2Get##TYPE(fmi2Component c, const fmi2ValueReference places[], size_t n,                 \
                                         fmi2##TYPE values[])                                                          \
    {                                                                                                                  \
        fmi2Status status = fmi2OK;                                                                                    \
        double value = 0.0;                                                                                            \
        for (size_t i = 0; status == fmi2OK && i < n; i++) {                                                           \
            status = get(c, places[i], &value);                                                                        \
            values[i] = (fmi2##TYPE)value;                                                                             \
        }                                                                                                              \
        return status;                                                                                                 \
    }
#define SET(TYPE)                                                                                                      \
    FMI2_Export fmi2Status fmi2Set##TYPE(fmi2Component c, const fmi2ValueReference places[], size_t n,                 \
                                         const fmi2##TYPE values[])                                                    \
    {                                                                                                                  \
        fmi2Status status = fmi2OK;                                                                                    \
        for (size_t i = 0; status == fmi2OK && i < n; i++)                                                             \
            status = set(c, places[i], (double)values[i]);                                                             \
        return status;                                                                                                 \
    }
GET(Real)
GET(Integer)
GET(Boolean)
SET(Real)
SET(Integer)
SET(Boolean)

FMI2_Export fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference places[], size_t n, fmi2String values[])
{
    (void)places, (void)values;
    return n ? say(c, fmi2Error, "there is no text in this FMU") : fmi2OK;
}

FMI2_Export fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference places[], size_t n,
                                     const fmi2String values[])
{
    (void)places, (void)values;
    return n ? say(c, fmi2Error, "there is no text in this FMU") : fmi2OK;
}

FMI2_Export fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real length, fmi2Boolean no_way_back)
{
    Instance *self = c;
    double now = self->drive.start_time + self->drive.block[TIME];
    int64_t steps = llround(length / STEP);
    (void)no_way_back;
    if (self->drive.phase != STEPPING)
        return say(self, fmi2Error, "a step needs the initialization first");
    if (steps < 1 || fabs(length - (double)steps * STEP) > 1e-9 * (double)steps)
        return say(self, fmi2Error, "the step must be a whole multiple of %g s; it is %.12g s", STEP, length);
    if (fabs(time - now) > 0.5 * STEP)
        return say(self, fmi2Error, "the step must begin where the last one ended, at %.9g s; it begins at %.9g s",
                   now, time);
    return advance(self, steps);
}

FMI2_Export fmi2Status fmi2CancelStep(fmi2Component c)
{
    return say(c, fmi2Error, "no step takes place in the background");
}

FMI2_Export fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    if (!*state && !(*state = malloc(sizeof(Drive))))
        return say(c, fmi2Error, "there is no memory for a state");
    memcpy(*state, &((Instance *)c)->drive, sizeof(Drive));
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    memcpy(&((Instance *)c)->drive, state, sizeof(Drive));
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    (void)c;
    free(*state);
    *state = NULL;
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    (void)c, (void)state;
    *size = sizeof(Drive);
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    if (size < sizeof(Drive))
        return say(c, fmi2Error, "a state takes %zu bytes; there is room for %zu", sizeof(Drive), size);
    memcpy(bytes, state, sizeof(Drive));
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size,
                                               fmi2FMUstate *state)
{
    if (size != sizeof(Drive))
        return say(c, fmi2Error, "a state takes %zu bytes; there are %zu", sizeof(Drive), size);
    if (!*state && !(*state = malloc(sizeof(Drive))))
        return say(c, fmi2Error, "there is no memory for a state");
    memcpy(*state, bytes, sizeof(Drive));
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t n,
                                                    const fmi2ValueReference known[], size_t m,
                                                    const fmi2Real by_known[], fmi2Real by_unknown[])
{
    (void)unknown, (void)n, (void)known, (void)m, (void)by_known, (void)by_unknown;
    return say(c, fmi2Error, "there are no directional derivatives in this FMU");
}

FMI2_Export fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference places[], size_t n,
                                                   const fmi2Integer orders[], const fmi2Real values[])
{
    (void)places, (void)n, (void)orders, (void)values;
    return say(c, fmi2Error, "inputs are held within a step; they have no derivatives");
}

FMI2_Export fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference places[], size_t n,
                                                    const fmi2Integer orders[], fmi2Real values[])
{
    (void)places, (void)n, (void)orders, (void)values;
    return say(c, fmi2Error, "outputs have no derivatives in this FMU");
}

FMI2_Export fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value)
{
    Instance *self = c;
    if (kind != fmi2LastSuccessfulTime)
        return fmi2Discard;
    *value = self->drive.start_time + self->drive.block[TIME];
    return fmi2OK;
}

#define NO_STATUS(NAME, TYPE)                                                                                          \
    FMI2_Export fmi2Status fmi2Get##NAME(fmi2Component c, const fmi2StatusKind kind, TYPE *value)                      \
    {                                                                                                                  \
        (void)c, (void)kind, (void)value;                                                                              \
        return fmi2Discard;                                                                                            \
    }
NO_STATUS(Status, fmi2Status)
NO_STATUS(IntegerStatus, fmi2Integer)
NO_STATUS(BooleanStatus, fmi2Boolean)
NO_STATUS(StringStatus, fmi2String)
