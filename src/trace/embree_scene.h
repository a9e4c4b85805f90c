/* What is behind vsh_triangles, for the files that trace them. */
#ifndef VSHI_EMBREE_SCENE_H
#define VSHI_EMBREE_SCENE_H

#include "trace/embree.h"
#include "trace/terrain.h"

#include <stdint.h>

#include <embree3/rtcore.h>
#include <stdatomic.h>

/* Embree's functions that are called. */
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

/* A pointer to each, and nothing else: embree_load.c fills it as an array. */
typedef struct vshi_embree {
#define VSHI_EMBREE_CALL(name) __typeof__(name) *name;
    VSHI_EMBREE_CALLS(VSHI_EMBREE_CALL)
} vshi_embree;

/* Loads Embree once, for as long as the process lives. Errors: VSH_ERROR_UNSUPPORTED (it is not there). */
vsh_result vshi_embree_load(const vshi_embree **embree, vsh_error *error);

/* Where a triangle's solid lies, as its corners turn. */
enum { VSHI_AIR_AROUND, VSHI_SOLID_BEHIND, VSHI_SOLID_BEFORE, VSHI_SOLID_SIDE = 3 };
/* Added to it where the solid is closed over holes: rays from inside may leave by them. */
enum { VSHI_SOLID_HOLED = 4 };
/* Added to it for the faces of an open solid (vshi_component.vessel). */
enum { VSHI_SOLID_VESSEL = 8 };

struct vshi_sieve; /* below */

/* A mesh that is a terrain. Its sides and bottom are triangles like others, its top is a geometry of its own.
 */
typedef struct vshi_terrain_part {
    size_t mesh;
    vshi_terrain grid;
    vshi_relief relief;
    float corners[8][3]; /* of the box around its top, in the scene's units */
} vshi_terrain_part;

/* The texels of a mask. */
typedef struct vshi_texture {
    uint8_t *alpha;
    const uint8_t *of; /* what they are a copy of */
    size_t texels;
} vshi_texture;

/* Embree counts in floats, drops what is beyond 1.8e18 and loses what is very small, so it gets the scene
 * around 0 and of a size near 1: `scale` is a power of two, which rounds nothing. */
struct vsh_triangles {
    const vshi_embree *embree;
    RTCDevice device;
    RTCScene scene;
    size_t count;                /* triangles of all geometries, numbered one after the other */
    uint32_t *first;             /* number of each geometry's first triangle */
    uint8_t *solid;              /* [count]: where each one's solid lies */
    vshi_terrain_part *terrains; /* [terrain_count] */
    size_t terrain_count;
    unsigned first_terrain; /* geometries from here on are the tops of terrains */
    bool has_solids;        /* any */
    bool has_holes;         /* in any of them */
    bool has_vessels;       /* any sheet is a vessel */
    bool wide;              /* VSHI_PACKET rays are traced at once, not in two halves */
    double low[3], high[3]; /* the triangles' box, world space; min > max where there are none */
    bool fine; /* a surface's quads, smaller than what lies between rays that go together: traced one by
                  one these are a quarter faster */
    double centre[3];
    double scale;
    double size;               /* of the longest side of the triangles' box, world units */
    struct vshi_sieve *sieves; /* [sieve_count], of the geometries; NULL: none lets rays through */
    size_t sieve_count, texture_count, sieve_bytes;
    vshi_texture *textures;
    const vsh_solids *solids; /* beside the triangles; may be NULL. Geometries after those of the meshes have
                               * no triangles */
    bool owns_solids;
    uint64_t limit; /* bytes that Embree may hold; 0: no limit */
    atomic_llong bytes;
    atomic_bool refused;
};

/* Adds triangles->solids to the scene as one geometry; false where Embree refuses: its error says why. */
bool vshi_triangles_attach_solids(vsh_triangles *triangles);

/* VSHI_SOLID_… of a primitive of a geometry. */
static inline uint8_t vshi_triangles_solid(const vsh_triangles *triangles, unsigned mesh, unsigned local) {
    return mesh >= triangles->first_terrain ? VSHI_SOLID_BEHIND
                                            : triangles->solid[triangles->first[mesh] + local];
}

/* Rows of N values that the rays and hits of a packet are made of; Embree has names for them in C++ only. A
 * hit's rows follow those of its ray. */
enum { VSHI_RAY_ORIGIN = 0, VSHI_RAY_NEAR = 3, VSHI_RAY_DIRECTION = 4, VSHI_RAY_FAR = 8, VSHI_RAY_ROWS = 12 };
enum { VSHI_HIT_NORMAL = 0, VSHI_HIT_U = 3, VSHI_HIT_V = 4, VSHI_HIT_TRIANGLE = 5, VSHI_HIT_MESH = 6 };

/* The vector of lane `lane` in the three rows from `row` on. */
static inline vshi_vec vshi_packet_vector(const void *packet, size_t row, size_t lanes, size_t lane) {
    const float *at = (const float *)packet + row * lanes + lane;
    return (vshi_vec){(double)at[0], (double)at[lanes], (double)at[2 * lanes]};
}

/* Adds a geometry of `count` primitives that are no triangles, as geometry `number` of the scene; false where
 * Embree refuses: its error says why. */
bool vshi_triangles_attach_own(const vsh_triangles *triangles, unsigned number, size_t count, void *user,
                               RTCBoundsFunction bounds, RTCIntersectFunctionN intersect,
                               RTCOccludedFunctionN occlude);

/* How packets go on: all rays together, or (where they go apart) each by itself. Terrains follow a packet's
 * rays all at once in any case. */
static inline enum RTCIntersectContextFlags vshi_triangles_flags(const vsh_triangles *triangles,
                                                                 bool together) {
    return !triangles->fine && (together || triangles->terrain_count > 0)
               ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT
               : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
}

/* Adds the geometry of terrain `number`; false where Embree refuses. */
bool vshi_terrain_attach(const vsh_triangles *triangles, size_t number);

/* Rays that are traced at a time, where the machine has vectors so wide; else half as many, twice. On the
 * cloister, towards a sun of 5°, a ray takes 36 ns alone, 15 of eight and 9.5 of sixteen that are told to go
 * together; on lobes of 50,000 triangles 55, 38 and 28. */
enum { VSHI_PACKET = 16 };

/* A ray that begins farther than this from the scene, whose half size is at most 1, is moved up to it. */
#define VSHI_FAR_ORIGIN 4.0

/* Lane `lane` of a packet, in the scene's own units; false where the ray ends before it comes near. */
bool vshi_triangles_aim(const vsh_triangles *triangles, const vshi_segment_ray *ray, struct RTCRay16 *packet,
                        int lane);

/* Occludes a packet: tfar of a valid ray that meets something is -∞ then. */
void vshi_triangles_occlude(const vsh_triangles *triangles, const int *valid,
                            struct RTCIntersectContext *context, struct RTCRay16 *packet);

/* Whether rays go much the same way. */
bool vshi_rays_together(const vshi_segment_ray *rays, int count);

/* Triangles let rays through where a mask cuts them out, and from behind if they are one-sided. */

#include "mesh/alpha_mask.h"

/* Of a geometry. */
typedef struct vshi_sieve {
    vsh_alpha_mask mask;     /* its texels belong to the triangles */
    vshi_mask_place *places; /* [triangles][3]: of the corners, in the mask; NULL: it has none */
    bool one_sided;
    bool mirrored;           /* its faces look where their corners run clockwise */
    const float *vertices;   /* [vertices][3], in the scene's units */
    const uint32_t *corners; /* [triangles][3] */
} vshi_sieve;

/* Copies what the meshes let through: triangles->sieves stays NULL where that is nothing. `held`: bytes that
 * are taken beside. Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
vsh_result vshi_sieves_create(vsh_triangles *triangles, const vsh_mesh *meshes, size_t count,
                              const vsh_run *run, double held, vsh_error *error);
void vshi_sieves_free(vsh_triangles *triangles);

/* Lets rays pass through the geometry of a mesh where its mask and its sides allow. Vertices and corners are
 * Embree's buffers of it. */
void vshi_sieve_attach(const vsh_triangles *triangles, size_t mesh, RTCGeometry geometry,
                       const float *vertices, const uint32_t *corners);

#endif
