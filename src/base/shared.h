/* Marks what modules of this library call of it: exported under a version of its own (cmake/exports.map.in),
 * for nobody else. */
#ifndef VSHI_BASE_SHARED_H
#define VSHI_BASE_SHARED_H

#define VSHI_SHARED __attribute__((visibility("default")))

#endif
