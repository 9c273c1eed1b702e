/* As much of Open Image Denoise's C interface as the program calls, with filters that can be worked out by hand: of
   colours, color + albedo + 10 normal; of anything else, twice that. It fails if OIDN_STUB_FAILS is set. */
#include <stdbool.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#ifndef MAJOR
#define MAJOR 2
#endif

typedef struct { const float* color; const float* albedo; const float* normal; float* output; size_t numbers; bool hdr, clean; } Filter;
static int device;
static Filter filter;
static const char* error;

void* oidnNewDevice(int type) { return type == 1 ? &device : NULL; }
void oidnSetDeviceInt(void* d, const char* name, int value) {}
int oidnGetDeviceInt(void* d, const char* name) { return strcmp(name, "versionMajor") == 0 ? MAJOR : 7; }
void oidnCommitDevice(void* d) {}
void oidnReleaseDevice(void* d) {}

int oidnGetDeviceError(void* d, const char** message) {
    const char* now = error;
    error = NULL;
    *message = now;
    return now ? 4 : 0;
}

void* oidnNewFilter(void* d, const char* type) {
    memset(&filter, 0, sizeof filter);
    return d == &device && strcmp(type, "RT") == 0 ? &filter : NULL;
}

void oidnSetSharedFilterImage(void* f, const char* name, void* pixels, int format, size_t width, size_t height,
                              size_t offset, size_t pixel, size_t row) {
    if (format != 3 || offset != 0 || pixel != 0 || row != 0) error = "planes are of three floats without gaps";
    if (filter.numbers != 0 && filter.numbers != 3 * width * height) error = "images are of one size";
    filter.numbers = 3 * width * height;
    if (strcmp(name, "color") == 0) filter.color = pixels;
    else if (strcmp(name, "albedo") == 0) filter.albedo = pixels;
    else if (strcmp(name, "normal") == 0) filter.normal = pixels;
    else if (strcmp(name, "output") == 0) filter.output = pixels;
    else error = "there is no such image";
}

#ifdef OLD
void oidnSetFilter1b(void* f, const char* name, bool value) {}
#else
void oidnSetFilterBool(void* f, const char* name, bool value) {
    if (strcmp(name, "hdr") == 0) filter.hdr = value;
    else if (strcmp(name, "cleanAux") == 0) filter.clean = value;
    else error = "there is no such parameter";
}
#endif

void oidnCommitFilter(void* f) {
    if (!filter.output) error = "there is no output";
    if (filter.color && !filter.hdr) error = "radiances are of any size";
    if (filter.color && filter.clean != (filter.albedo != NULL)) error = "guides are filtered before";
    if (filter.color && filter.normal && !filter.albedo) error = "normals take albedo";
}

void oidnExecuteFilter(void* f) {
    if (getenv("OIDN_STUB_FAILS")) error = "out of memory,\nas planted";
    if (error) return;
    for (size_t i = 0; i < filter.numbers; ++i) {
        if (filter.color)
            filter.output[i] = filter.color[i] + (filter.albedo ? filter.albedo[i] : 0) +
                               (filter.normal ? 10 * filter.normal[i] : 0);
        else
            filter.output[i] = 2 * (filter.albedo ? filter.albedo[i] : filter.normal[i]);
    }
}

void oidnReleaseFilter(void* f) {}
