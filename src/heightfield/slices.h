/* A light's disc in slices that stand upright over the ground, each of which a horizon cuts once. */
#ifndef VSHI_ANALYTIC_SLICES_H
#define VSHI_ANALYTIC_SLICES_H

#include "heightfield/height_pyramid.h"

/* One slice: the directions of one azimuth within the disc. The disc is that of the tangent plane a unit away
 * along the light's axis; all azimuths' lines in it meet at the zenith. */
typedef struct vshi_slice {
    double sine, cosine; /* of the line to the vertical, in the plane */
    double middle;       /* how far up the plane the chord's middle is; polar: not used */
    double half;         /* of the chord; polar: its length from the zenith */
    double spread;       /* by how much farther from the zenith the slice is wider, per half chord */
    double azimuth;      /* cosine of the azimuth from the light's; polar: length along the ground */
    double bottom, top;  /* slopes of the chord's ends */
    double weight;       /* share of the disc */
} vshi_slice;

typedef struct vshi_slices {
    double sine, cosine; /* of the light's elevation */
    bool polar;          /* the zenith, or the nadir, is within the disc: slices meet there */
    bool hard;           /* one direction */
    vshi_slice slice[VSHI_FAN];
    double x[VSHI_FAN], z[VSHI_FAN]; /* along the ground, unit */
    vshi_fan fan;                    /* ready to be walked */
} vshi_slices;

/* Slices of the disc of radius `radius` a unit away along the unit `axis`, in which what is farther than
 * `far` does not count. */
void vshi_slices_make(vshi_vec axis, double radius, double far, vshi_slices *slices);

/* Share of a slice whose slope is above `slope`. */
double vshi_slice_above(const vshi_slices *slices, int k, double slope);

#endif
