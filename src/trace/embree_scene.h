/* The Embree scene behind vshi_triangles, which embree.c builds and embree_rays.c traces. */
#pragma once

#include "geometry/alpha_mask.h"
#include "trace/trace.h"

#include <stdint.h>

#include <embree3/rtcore.h>
#include <stdatomic.h>

/* The functions of Embree that we call. */
#define VSHI_EMBREE_CALLS(CALL)                                                                              \
    CALL(rtcAttachGeometry)                                                                                  \
    CALL(rtcAttachGeometryByID)                                                                              \
    CALL(rtcCommitGeometry)                                                                                  \
    CALL(rtcCommitScene)                                                                                     \
    CALL(rtcGetDeviceError)                                                                                  \
    CALL(rtcGetDeviceProperty)                                                                               \
    CALL(rtcIntersect1)                                                                                      \
    CALL(rtcNewDevice)                                                                                       \
    CALL(rtcNewGeometry)                                                                                     \
    CALL(rtcNewScene)                                                                                        \
    CALL(rtcOccluded16)                                                                                      \
    CALL(rtcOccluded8)                                                                                       \
    CALL(rtcReleaseDevice)                                                                                   \
    CALL(rtcReleaseGeometry)                                                                                 \
    CALL(rtcReleaseScene)                                                                                    \
    CALL(rtcSetDeviceMemoryMonitorFunction)                                                                  \
    CALL(rtcSetGeometryBoundsFunction)                                                                       \
    CALL(rtcSetGeometryIntersectFunction)                                                                    \
    CALL(rtcSetGeometryOccludedFunction)                                                                     \
    CALL(rtcSetGeometryUserPrimitiveCount)                                                                   \
    CALL(rtcSetGeometryIntersectFilterFunction)                                                              \
    CALL(rtcSetGeometryOccludedFilterFunction)                                                               \
    CALL(rtcSetGeometryUserData)                                                                             \
    CALL(rtcSetNewGeometryBuffer)                                                                            \
    CALL(rtcSetSceneBuildQuality)                                                                            \
    CALL(rtcSetSceneFlags)                                                                                   \
    CALL(rtcSetSceneProgressMonitorFunction)

/* A pointer to each, and nothing else: embree.c fills it as an array. */
typedef struct vshi_embree {
#define VSHI_EMBREE_CALL(name) __typeof__(name) *name;
    VSHI_EMBREE_CALLS(VSHI_EMBREE_CALL)
} vshi_embree;

/* Side of a triangle, by its corners' order, on which its solid lies. */
enum { VSHI_AIR_AROUND, VSHI_SOLID_BEHIND, VSHI_SOLID_BEFORE, VSHI_SOLID_SIDE = 3 };
/* Flag of solids closed over holes: rays from inside may leave by these. */
enum { VSHI_SOLID_HOLED = 4 };
/* Flag of an open solid's faces (vshi_component.vessel). */
enum { VSHI_SOLID_VESSEL = 8 };

/* A copy of a mask's texels. */
typedef struct vshi_texture {
    uint8_t *alpha;
    const uint8_t *of; /* the original */
    size_t texels;
} vshi_texture;

/* Triangles of a geometry that let rays through where a mask cuts them out, and from behind if they are
 * one-sided. */
typedef struct vshi_sieve {
    vsh_alpha_mask mask;     /* its texels belong to the scene */
    vshi_mask_place *places; /* [triangles][3]: of the corners, in the mask; NULL: it has none */
    bool one_sided;
    bool mirrored;           /* the corners of its fronts run clockwise */
    const float *vertices;   /* [vertices][3], in the scene's units */
    const uint32_t *corners; /* [triangles][3] */
} vshi_sieve;

/* Embree uses floats, drops coordinates beyond 1.8e18 and loses tiny ones. So it gets the scene around 0 and
 * of a size near 1: `scale` is a power of two, which rounds nothing. */
struct vshi_triangles {
    const vshi_embree *embree;
    RTCDevice device;
    RTCScene scene;
    size_t count;                            /* triangles or quads of all geometries, numbered in order */
    uint32_t *first;                         /* number of each geometry's first triangle */
    uint8_t *solid;                          /* [count]: VSHI_SOLID_… */
    size_t *cells;                           /* of the meshes: of terrains, which are quads; else 0 */
    bool has_solids, has_holes, has_vessels; /* whether any triangle has that flag */
    bool wide;                               /* 16 rays are traced at once, not in two halves */
    double low[3], high[3]; /* the triangles' box, world space; low > high if there are none */
    bool fine; /* quads smaller than the gaps between a packet's rays: a quarter faster one by one */
    double centre[3];
    double scale;
    double size;        /* longest side of the triangles' box, world units */
    vshi_sieve *sieves; /* [sieve_count], of the geometries; NULL: none lets rays through */
    size_t sieve_count, texture_count, sieve_bytes;
    vshi_texture *textures;
    vshi_solids *solids; /* the geometry after the meshes; may be NULL */
    uint64_t limit;      /* bytes that Embree may hold; 0: no limit */
    atomic_llong bytes;
    atomic_bool refused;
};

/* Rows of N values of a packet's rays and hits; Embree names them in C++ only. Hits follow their rays. */
enum { VSHI_RAY_ORIGIN = 0, VSHI_RAY_NEAR = 3, VSHI_RAY_DIRECTION = 4, VSHI_RAY_FAR = 8, VSHI_RAY_ROWS = 12 };
enum { VSHI_HIT_NORMAL = 0, VSHI_HIT_U = 3, VSHI_HIT_V = 4, VSHI_HIT_TRIANGLE = 5, VSHI_HIT_MESH = 6 };

/* The vector of lane `lane` in the three rows from `row` on. */
static inline vshi_vec vshi_packet_vector(const void *packet, size_t row, size_t lanes, size_t lane) {
    const float *at = (const float *)packet + row * lanes + lane;
    return (vshi_vec){(double)at[0], (double)at[lanes], (double)at[2 * lanes]};
}
