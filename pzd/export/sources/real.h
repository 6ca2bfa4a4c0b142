/* Double precision, or with DAMPER_SINGLE defined single precision, for numbers and functions alike. */
#ifndef REAL_H
#define REAL_H

#include <math.h>

#ifdef DAMPER_SINGLE
typedef float real;
#define R(number) number##f
#define EITHER(in_double, in_single) in_single##f
#define M(function) function##f
#else
typedef double real;
#define R(number) number
#define EITHER(in_double, in_single) in_double
#define M(function) function
#endif

#define R_INFINITY ((real)INFINITY)
#define R_NAN ((real)NAN)

#endif
