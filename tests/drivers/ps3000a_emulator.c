/* A small ps3000a library with the vendor's C interface, written from its header.
 *
 * It proves that the driver's ctypes table fits an independently compiled library:
 * widths, order, calling convention, callbacks, pointers. Time is virtual and is moved
 * by emulator_advance, or real if EMULATOR_REAL_TIME is set. Sample k of input c has the code ((k % 249) - 124 + c) * 256.
 */
#include <math.h>
#include <pthread.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#ifdef _WIN32
#define API __declspec(dllexport)
#define CALL __stdcall
#else
#define API __attribute__((visibility("default")))
#define CALL
#endif

typedef uint32_t PICO_STATUS;
typedef int32_t ENUM;
typedef void(CALL *StreamingReady)(int16_t handle, int32_t samples, uint32_t start,
                                   int16_t overflow, uint32_t triggerAt,
                                   int16_t triggered, int16_t autoStop, void *p);

enum {
    OK = 0x00, NOT_FOUND = 0x03, INVALID_HANDLE = 0x0C, INVALID_PARAMETER = 0x0D,
    INVALID_VOLTAGE_RANGE = 0x0F, INVALID_CHANNEL = 0x10,
    STREAMING_FAILED = 0x14, NULL_PARAMETER = 0x16,
    INVALID_SAMPLE_INTERVAL = 0x2B, INVALID_COUPLING = 0x45,
    BUFFERS_NOT_SET = 0x46, REQUEST_INVALID = 0x11B, BUSY = 0x27,
    SIGGEN_TRIGGER_SOURCE = 0x30, SIGGEN_OFFSET_VOLTAGE = 0x38, SIGGEN_PK_TO_PK = 0x39
};
enum { HANDLE = 0x1234, INPUTS = 4, PERIOD = 249, TABLE = 64 };

static struct {
    int open, streaming, on_thread;
    int enabled[INPUTS];
    ENUM coupling[INPUTS], range[INPUTS];
    float offset[INPUTS];
    int16_t *buffer[INPUTS];
    int32_t length[INPUTS];
    double now, interval, began;
    uint64_t next;
    uint32_t place, ring;
    uint32_t power;
    int32_t hold;
    int waiting, started, samples, peak;
    uint32_t phase, swing;
} u;

/* fill n samples of an input from sample k on, from a table of many periods */
static void render(int16_t *to, uint64_t k, uint32_t n, int input) {
    static int16_t table[INPUTS][PERIOD * (TABLE + 1)];
    if (!table[input][1])
        for (int i = 0; i < PERIOD * (TABLE + 1); i++)
            table[input][i] = (int16_t)((i % PERIOD - PERIOD / 2 + input) * 256);
    while (n) {
        uint32_t part = n < PERIOD * TABLE ? n : PERIOD * TABLE;
        memcpy(to, table[input] + k % PERIOD, part * sizeof *to);
        to += part, k += part, n -= part;
    }
}

static double now(void) {
    struct timespec t;
    if (!getenv("EMULATOR_REAL_TIME")) return u.now;
    timespec_get(&t, TIME_UTC);
    return (double)t.tv_sec + t.tv_nsec / 1e9;
}

static int inputs(void) {
    int n = 0;
    for (int c = 0; c < INPUTS; c++) n += u.enabled[c];
    return n;
}

static int fastest(void) {
    int n = inputs();
    return n > 2 ? 2 : n > 1 ? 1 : 0;
}

/* what the tests use */
API void emulator_advance(double seconds) { u.now += seconds; }
API void emulator_reset(void) { memset(&u, 0, sizeof u); }
API void emulator_power(uint32_t status) { u.power = status; }
API void emulator_callbacks_on_thread(int on) { u.on_thread = on; }
API double emulator_offset(int input) { return u.offset[input]; }
API int emulator_range(int input) { return u.enabled[input] ? u.range[input] : -1; }

API PICO_STATUS CALL ps3000aOpenUnit(int16_t *handle, int8_t *serial) {
    if (!handle) return NULL_PARAMETER;
    *handle = 0;
    if (u.open || (serial && strcmp((const char *)serial, "EMU00/001"))) return NOT_FOUND;
    u.open = 1;
    *handle = HANDLE;
    return u.power;
}

API PICO_STATUS CALL ps3000aCloseUnit(int16_t handle) {
    if (handle != HANDLE || !u.open) return INVALID_HANDLE;
    u.open = u.streaming = 0;
    return OK;
}

API PICO_STATUS CALL ps3000aEnumerateUnits(int16_t *count, int8_t *serials,
                                           int16_t *length) {
    static const char plain[] = "EMU00/001", more[] = "EMU00/001[3404D]";
    if (!count || !length) return NULL_PARAMETER;
    const char *text =
        serials && *length > 2 && !strncmp((char *)serials, "-v", 2) ? more : plain;
    *count = 1;
    if (serials && *length > (int16_t)strlen(text)) strcpy((char *)serials, text);
    *length = (int16_t)strlen(text);
    return OK;
}

API PICO_STATUS CALL ps3000aGetUnitInfo(int16_t handle, int8_t *text, int16_t length,
                                        int16_t *needed, uint32_t info) {
    static const char *const known[] = {"emulator", "3.0", "1", "3404D", "EMU00/001",
                                        "01Jan26"};
    if (handle != HANDLE || !u.open) return INVALID_HANDLE;
    if (info > 5) return INVALID_PARAMETER;
    if (needed) *needed = (int16_t)(strlen(known[info]) + 1);
    if (!text || length < (int16_t)strlen(known[info]) + 1) return NULL_PARAMETER;
    strcpy((char *)text, known[info]);
    return OK;
}

API PICO_STATUS CALL ps3000aPingUnit(int16_t handle) {
    return handle == HANDLE && u.open ? OK : INVALID_HANDLE;
}

API PICO_STATUS CALL ps3000aCurrentPowerSource(int16_t handle) {
    return handle == HANDLE ? 0x119 : INVALID_HANDLE;
}

API PICO_STATUS CALL ps3000aChangePowerSource(int16_t handle, PICO_STATUS power) {
    if (handle != HANDLE) return INVALID_HANDLE;
    if (power != u.power) return REQUEST_INVALID;
    u.power = OK;
    return OK;
}

API PICO_STATUS CALL ps3000aMaximumValue(int16_t handle, int16_t *value) {
    if (handle != HANDLE) return INVALID_HANDLE;
    *value = 32512;
    return OK;
}

API PICO_STATUS CALL ps3000aGetAnalogueOffset(int16_t handle, ENUM range, ENUM coupling,
                                              float *most, float *least) {
    if (handle != HANDLE) return INVALID_HANDLE;
    if (range < 1 || range > 10) return INVALID_VOLTAGE_RANGE;
    if (coupling != 0 && coupling != 1) return INVALID_COUPLING;
    *most = range < 5 ? 0.25f : range < 8 ? 2.5f : 20.0f;
    *least = -*most;
    return OK;
}

API PICO_STATUS CALL ps3000aSetChannel(int16_t handle, ENUM channel, int16_t enabled,
                                       ENUM coupling, ENUM range, float offset) {
    if (handle != HANDLE) return INVALID_HANDLE;
    if (u.power) return u.power;
    if (channel < 0 || channel >= INPUTS) return INVALID_CHANNEL;
    if (coupling != 0 && coupling != 1) return INVALID_COUPLING;
    if (range < 1 || range > 10) return INVALID_VOLTAGE_RANGE;
    u.enabled[channel] = enabled != 0;
    u.coupling[channel] = coupling;
    u.range[channel] = range;
    u.offset[channel] = offset;
    return OK;
}

API PICO_STATUS CALL ps3000aSetSimpleTrigger(int16_t handle, int16_t enable, ENUM source,
                                             int16_t threshold, ENUM direction,
                                             uint32_t delay, int16_t automatic) {
    if (handle != HANDLE) return INVALID_HANDLE;
    if (enable && (source < 0 || source >= INPUTS || delay || direction < 2 ||
                   direction > 3 || automatic < 1 || threshold == -32768))
        return INVALID_PARAMETER;
    return OK;
}

API PICO_STATUS CALL ps3000aSetDataBuffer(int16_t handle, ENUM channel, int16_t *buffer,
                                          int32_t length, uint32_t segment, ENUM mode) {
    if (handle != HANDLE) return INVALID_HANDLE;
    if (channel < 0 || channel >= INPUTS) return INVALID_CHANNEL;
    if (segment || mode) return INVALID_PARAMETER;
    u.buffer[channel] = buffer;
    u.length[channel] = length;
    return OK;
}

API PICO_STATUS CALL ps3000aRunStreaming(int16_t handle, uint32_t *interval, ENUM unit,
                                         uint32_t before, uint32_t after,
                                         int16_t autoStop, uint32_t ratio, ENUM mode,
                                         uint32_t overview) {
    static const double scale[] = {1e-15, 1e-12, 1e-9, 1e-6, 1e-3, 1.0};
    if (handle != HANDLE) return INVALID_HANDLE;
    if (!interval || unit < 0 || unit > 5 || autoStop || ratio != 1 || mode || before ||
        after != overview)
        return INVALID_PARAMETER;
    double ticks = floor(*interval * scale[unit] / 8e-9 + 0.5);
    if (ticks < (1 << fastest())) return INVALID_SAMPLE_INTERVAL;
    u.ring = overview;
    for (int c = 0; c < INPUTS; c++)
        if (u.enabled[c] && (!u.buffer[c] || (uint32_t)u.length[c] != overview))
            return BUFFERS_NOT_SET;
    u.interval = ticks * 8 / 1e9;
    *interval = (uint32_t)floor(u.interval / scale[unit] + 0.5);
    u.began = now();
    u.next = u.place = 0;
    u.streaming = 1;
    return OK;
}

struct call {
    StreamingReady ready;
    int32_t samples;
    uint32_t start;
    int16_t overflow;
    void *p;
};

static void *announce(void *argument) {
    struct call *c = argument;
    c->ready(HANDLE, c->samples, c->start, c->overflow, 0, 0, 0, c->p);
    return 0;
}

API PICO_STATUS CALL ps3000aGetStreamingLatestValues(int16_t handle, StreamingReady ready,
                                                     void *p) {
    if (handle != HANDLE) return INVALID_HANDLE;
    if (!ready) return NULL_PARAMETER;
    if (!u.streaming) return STREAMING_FAILED;
    uint64_t produced = (uint64_t)floor((now() - u.began) / u.interval + 1e-6);
    uint64_t waiting = produced - u.next;
    if (waiting > u.ring) { /* starved: the oldest are lost, without a word */
        u.next += waiting - u.ring;
        waiting = u.ring;
    }
    uint32_t n = u.ring - u.place < waiting ? u.ring - u.place : (uint32_t)waiting;
    if (!n) return OK;
    struct call c = {ready, (int32_t)n, u.place, 0, p};
    for (int i = 0; i < INPUTS; i++) {
        if (!u.enabled[i]) continue;
        render(u.buffer[i] + u.place, u.next, n, i);
        if (u.range[i] == 1) c.overflow |= (int16_t)(1 << i);
    }
    u.next += n;
    u.place = (u.place + n) % u.ring;
    if (u.on_thread) {
        pthread_t thread;
        pthread_create(&thread, 0, announce, &c);
        pthread_join(thread, 0);
    } else {
        announce(&c);
    }
    return OK;
}

/* the waveform generator: 20 MHz, a phase of 32 bits, 2^15 samples, 4 V */
API PICO_STATUS CALL ps3000aSetSigGenBuiltIn(
    int16_t handle, int32_t offset, uint32_t peaks, int16_t wave, float start, float stop,
    float increment, float dwell, ENUM sweep, ENUM operation, uint32_t shots,
    uint32_t sweeps, ENUM edge, ENUM trigger, int16_t level) {
    if (handle != HANDLE) return INVALID_HANDLE;
    if (u.streaming) return BUSY;
    if (wave != 8 || peaks || start != 0 || stop != 0 || increment != 0 || dwell != 0 ||
        sweep || operation || shots || sweeps || edge || trigger || level)
        return INVALID_PARAMETER;
    if (abs(offset) > 2000000) return SIGGEN_OFFSET_VOLTAGE;
    u.hold = offset, u.waiting = u.started = 0;
    return OK;
}

API PICO_STATUS CALL ps3000aSetSigGenArbitrary(
    int16_t handle, int32_t offset, uint32_t peaks, uint32_t start, uint32_t stop,
    uint32_t increment, uint32_t dwell, int16_t *samples, int32_t size, ENUM sweep,
    ENUM operation, ENUM index, uint32_t shots, uint32_t sweeps, ENUM edge, ENUM trigger,
    int16_t level) {
    if (handle != HANDLE) return INVALID_HANDLE;
    if (u.streaming) return BUSY;
    if (!samples) return NULL_PARAMETER;
    if (offset || increment || dwell || sweep || operation || index || sweeps || edge ||
        level || start != stop || !start || size < 1 || size > 32768 || shots != 1 ||
        trigger != 4)
        return INVALID_PARAMETER;
    if (peaks > 4000000) return SIGGEN_PK_TO_PK;
    u.phase = start, u.samples = size, u.swing = peaks, u.waiting = 1, u.peak = 0;
    for (int i = 0; i < size; i++)
        if (abs(samples[i]) > u.peak) u.peak = abs(samples[i]);
    return OK;
}

API PICO_STATUS CALL ps3000aSigGenArbitraryMinMaxValues(
    int16_t handle, int16_t *low, int16_t *high, uint32_t *least, uint32_t *most) {
    if (handle != HANDLE) return INVALID_HANDLE;
    *low = -32768, *high = 32767, *least = 1, *most = 32768;
    return OK;
}

API PICO_STATUS CALL ps3000aSigGenFrequencyToPhase(int16_t handle, double frequency,
                                                   ENUM index, uint32_t length,
                                                   uint32_t *phase) {
    if (handle != HANDLE) return INVALID_HANDLE;
    if (index) return INVALID_PARAMETER;
    *phase = (uint32_t)(frequency * length / 32768 * 4294967296.0 / 20e6 + 0.5);
    return OK;
}

API PICO_STATUS CALL ps3000aSigGenSoftwareControl(int16_t handle, int16_t state) {
    (void)state;
    if (handle != HANDLE) return INVALID_HANDLE;
    if (!u.waiting) return SIGGEN_TRIGGER_SOURCE;
    u.started++;
    return OK;
}

API int emulator_generator(int what) {
    int known[] = {u.hold, u.waiting, u.started, u.samples, u.peak, (int)u.phase,
                   (int)u.swing};
    return known[what];
}

API PICO_STATUS CALL ps3000aStop(int16_t handle) {
    if (handle != HANDLE) return INVALID_HANDLE;
    u.streaming = 0;
    return OK;
}
