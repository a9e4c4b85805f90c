/* Buffer views that are compressed by EXT_meshopt_compression (Khronos, "EXT_meshopt_compression", 2021), and
 * KHR_meshopt_compression where its data are of the same version. meshoptimizer unpacks them; what its
 * filters make of them is computed here by the text of the extension, as the library's own take approximate
 * reciprocals of roots, which differ between processors. */
#include "model/gltf.h"

#include <meshoptimizer.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ATTRIBUTES, TRIANGLES, INDICES, MODES };

/* Data begin with a byte whose lower half is their version. */
static const struct {
    const char *name;
    unsigned char header, versions; /* highest that is read */
} modes[MODES] = {{"ATTRIBUTES", 0xa0, 0}, {"TRIANGLES", 0xe0, 1}, {"INDICES", 0xd0, 1}};

typedef struct packed {
    vshi_gltf_bytes bytes;
    size_t count, stride;
    int mode, filter;
    const char *where;
} packed;

/* --- filters */

static float rounded_to(float value, float most) {
    const float whole = (float)(int32_t)(value >= 0.0F ? value + 0.5F : value - 0.5F);
    return whole > most ? most : whole < -most ? -most : whole;
}

/* A direction from its place on an octahedron whose corners are `one` away; of none where that is not
 * positive.
 */
static void unfold(const float given[3], float most, float made[3]) {
    memset(made, 0, sizeof(float[3]));
    if (!(given[2] > 0.0F)) {
        return;
    }
    float x = given[0] / given[2], y = given[1] / given[2];
    const float z = 1.0F - fabsf(x) - fabsf(y), over = z < 0.0F ? -z : 0.0F;
    x -= x >= 0.0F ? over : -over;
    y -= y >= 0.0F ? over : -over;
    const float scale = most / sqrtf(x * x + y * y + z * z);
    made[0] = rounded_to(x * scale, most);
    made[1] = rounded_to(y * scale, most);
    made[2] = rounded_to(z * scale, most);
}

static void decode_octahedral(unsigned char *at, size_t stride) {
    float given[3], made[3];
    for (int k = 0; k < 3; ++k) {
        int16_t two = (int8_t)at[k];
        if (stride == 8) {
            memcpy(&two, at + 2 * k, sizeof two);
        }
        given[k] = (float)two;
    }
    unfold(given, stride == 4 ? 127.0F : 32767.0F, made);
    for (int k = 0; k < 3; ++k) {
        const int16_t two = (int16_t)made[k];
        if (stride == 4) {
            at[k] = (unsigned char)(int8_t)two;
        } else {
            memcpy(at + 2 * k, &two, sizeof two);
        }
    }
}

/* Three components of a unit quaternion, and which one is left out as the largest. */
static void decode_quaternion(unsigned char *at, size_t stride) {
    static const float range = 0.70710678118654752F, most = 32767.0F;
    int16_t given[4], made[4];
    (void)stride;
    memcpy(given, at, sizeof given);
    const int largest = given[3] & 3;
    const float one = (float)(given[3] | 3);
    float square = 1.0F;
    for (int k = 0; k < 3; ++k) {
        const float value = (float)given[k] / one * range;
        square -= value * value;
        made[(largest + 1 + k) % 4] = (int16_t)rounded_to(value * most, most);
    }
    made[largest] = (int16_t)rounded_to(square > 0.0F ? sqrtf(square) * most : 0.0F, most);
    memcpy(at, made, sizeof made);
}

/* Floats of 8 bits of exponent and 24 of mantissa, both signed. */
static void decode_exponential(unsigned char *at, size_t stride) {
    for (size_t k = 0; k < stride; k += 4) {
        uint32_t bits;
        memcpy(&bits, at + k, sizeof bits);
        const int exponent = (int8_t)(bits >> 24);
        const int32_t mantissa = (int32_t)(bits << 8) >> 8;
        const uint64_t scale_bits = (uint64_t)(exponent + 1023) << 52;
        double scale;
        memcpy(&scale, &scale_bits, sizeof scale);
        const float value = (float)(scale * (double)mantissa);
        memcpy(at + k, &value, sizeof value);
    }
}

static const struct {
    const char *name;
    size_t least, most; /* bytes of an element */
    void (*decode)(unsigned char *at, size_t stride);
} filters[] = {{"NONE", 1, 256, NULL},
               {"OCTAHEDRAL", 4, 8, decode_octahedral},
               {"QUATERNION", 8, 8, decode_quaternion},
               {"EXPONENTIAL", 4, 256, decode_exponential}};

/* --- what a view says of itself */

static int index_of_mode(const char *name) {
    for (int i = 0; name != NULL && i < MODES; ++i) {
        if (strcmp(name, modes[i].name) == 0) {
            return i;
        }
    }
    return -1;
}

static int index_of_filter(const char *name) {
    for (int i = 0; i < (int)(sizeof filters / sizeof filters[0]); ++i) {
        if (name == NULL || strcmp(name, filters[i].name) == 0) {
            return i;
        }
    }
    return -1;
}

static bool stride_holds(const packed *p) {
    if (p->mode != ATTRIBUTES) {
        return (p->stride == 2 || p->stride == 4) && filters[p->filter].decode == NULL &&
               (p->mode == INDICES || p->count % 3 == 0);
    }
    return p->stride % 4 == 0 && p->stride >= filters[p->filter].least &&
           p->stride <= filters[p->filter].most;
}

/* Whether so few bytes can hold so many elements: 2 bits stand for 16 bytes of attributes, a byte for a
 * triangle or an index. */
static bool may_hold(const packed *p) {
    enum { DENSEST = 64, TAIL = 256 * 256 /* of elements that fill no block */ };
    const size_t size = p->bytes.size;
    return p->mode == ATTRIBUTES ? (double)p->count * (double)p->stride <= DENSEST * (double)size + TAIL
                                 : (p->mode == TRIANGLES ? p->count / 3 : p->count) <= size;
}

static vsh_result read_packed(vshi_gltf *gltf, const json_t *extension, packed *p, vsh_error *error) {
    const char *mode = json_string_value(json_object_get(extension, "mode"));
    const char *filter = json_string_value(json_object_get(extension, "filter"));
    p->mode = index_of_mode(mode);
    p->filter = index_of_filter(filter);
    if (p->mode < 0 || p->filter < 0) {
        return vshi_fail(error, VSH_ERROR_UNSUPPORTED,
                         "%s: %s: its compression has mode '%.40s' and filter '%.40s', which are not known",
                         gltf->path, p->where, mode != NULL ? mode : "", filter != NULL ? filter : "NONE");
    }
    if (!vshi_gltf_count(extension, "count", 0, &p->count) || p->count == 0 || p->count > UINT32_MAX ||
        !vshi_gltf_count(extension, "byteStride", 0, &p->stride) || !stride_holds(p)) {
        return vshi_gltf_fail(gltf, error,
                              "%s: its compression has count %zu and byteStride %zu, which %s with filter %s "
                              "cannot have",
                              p->where, p->count, p->stride, modes[p->mode].name, filters[p->filter].name);
    }
    VSHI_TRY(vshi_gltf_part(gltf, extension, p->where, &p->bytes, error));
    const unsigned char first = p->bytes.size > 0 ? p->bytes.at[0] : 0;
    if ((first & 0xf0) == modes[p->mode].header && (first & 0x0f) > modes[p->mode].versions) {
        return vshi_fail(
            error, VSH_ERROR_UNSUPPORTED,
            "%s: %s: its compressed %s are of version %d; up to version %d is read: 'gltfpack -i "
            "IN.glb -o OUT.glb' without -c writes them as they are",
            gltf->path, p->where, modes[p->mode].name, first & 0x0f, modes[p->mode].versions);
    }
    return may_hold(p) ? VSH_OK
                       : vshi_gltf_fail(gltf, error,
                                        "%s: its %zu compressed bytes cannot hold %zu elements of %zu bytes",
                                        p->where, p->bytes.size, p->count, p->stride);
}

/* --- unpacking */

static int unpack(const packed *p, unsigned char *to) {
    const unsigned char *from = p->bytes.at;
    const size_t size = p->bytes.size;
    return p->mode == ATTRIBUTES  ? meshopt_decodeVertexBuffer(to, p->count, p->stride, from, size)
           : p->mode == TRIANGLES ? meshopt_decodeIndexBuffer(to, p->count, p->stride, from, size)
                                  : meshopt_decodeIndexSequence(to, p->count, p->stride, from, size);
}

vsh_result vshi_gltf_read_meshopt(vshi_gltf *gltf, const json_t *extension, const char *where,
                                  unsigned char **made, size_t *size, vsh_error *error) {
    packed p = {.where = where};
    VSHI_TRY(read_packed(gltf, extension, &p, error));
    *size = p.count * p.stride; /* may_hold() */
    VSHI_TRY(vshi_gltf_take(gltf, (void **)made, p.count, p.stride, error));
    if (vshi_job_cancelled(gltf->job)) {
        return vshi_job_fail_cancelled(gltf->job, error);
    }
    if (unpack(&p, *made) != 0) {
        return vshi_gltf_fail(gltf, error,
                              "%s: its compressed %s are damaged: %zu bytes that are to hold %zu elements of "
                              "%zu bytes",
                              where, modes[p.mode].name, p.bytes.size, p.count, p.stride);
    }
    for (size_t i = 0; filters[p.filter].decode != NULL && i < p.count; ++i) {
        filters[p.filter].decode(*made + i * p.stride, p.stride);
    }
    return VSH_OK;
}
