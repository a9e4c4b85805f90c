/* Analytic truth: solids in closed form, and the light and ambient occlusion that rays against them find.
 * Shares no code with the library, so that no mistake is in both. */
#pragma once

#include <stdbool.h>
#include <stddef.h>

enum {
    TRUTH_SPHERE, /* radius */
    TRUTH_BOX,    /* half; grown by radius on every side (0: sharp) */
    TRUTH_TORUS   /* around y: radius of the ring, minor_radius of the tube */
};

typedef struct truth_solid {
    int shape;
    double center[3];
    double half[3];
    double radius;
    double minor_radius;
} truth_solid;

typedef struct truth_scene {
    const truth_solid *solids;
    size_t count;
} truth_scene;

/* The seeds' scene: plate, sphere, rounded box, torus, post. */
truth_scene truth_seeds(void);

/* The sun of the seeds' scene, towards it (not normalised), and the tangent of its half angle. */
extern const double truth_seeds_sun[3];
extern const double truth_seeds_w;

/* Signed distance to one solid (exact inside and outside), and to the nearest of a scene (exact outside). */
double truth_solid_distance(const truth_solid *solid, const double point[3]);
double truth_distance(truth_scene scene, const double point[3]);

/* Whether a ray touches the solid at 0 < t < limit; rays that begin inside it do. `direction` is unit. */
bool truth_solid_hit(const truth_solid *solid, const double origin[3], const double direction[3],
                     double limit);
bool truth_hit(truth_scene scene, const double origin[3], const double direction[3], double limit);

/* Fraction of a light that the point sees: `rays` directions whose points are uniform in area over the disc
 * of radius w, a unit away along `towards`. Rays end at `limit` (INFINITY for a directional light). Rays not
 * above the plane of `normal` count as hidden; NULL: no horizon. NAN if memory is short. */
double truth_light(truth_scene scene, const double point[3], const double *normal, const double towards[3],
                   double w, double limit, size_t rays);

/* Does the same at `count` points [count][3] that share a normal, for which it makes the directions once.
 * Returns 0, or -1 if memory is short. */
int truth_lights(truth_scene scene, size_t count, const double *points, const double *normal,
                 const double towards[3], double w, double limit, size_t rays, float *visible);

/* Cosine-weighted fraction of the hemisphere around the unit `normal` that is free within `distance`. */
double truth_ao(truth_scene scene, const double point[3], const double normal[3], double distance,
                size_t rays);
