/* A piece of a ray, for whatever it may meet. */
#ifndef VSHI_SEGMENT_H
#define VSHI_SEGMENT_H

/* In world space, from `origin` up to `far` along the unit `direction`. */
typedef struct vshi_segment_ray {
    double origin[3];
    double direction[3];
    double far; /* may be infinite */
} vshi_segment_ray;

#endif
