/* The layers of a film's error bars: of R, G, B and luminance Y, from its replicates (confidence.h). */
#ifndef CA_FILM_FILM_BARS_H
#define CA_FILM_FILM_BARS_H

#include "film/film.h"

/* None where the film's samples are not independent. By so many threads, on which no bit depends. CA_ERROR_MEMORY;
 * CA_ERROR_INTERRUPTED: nobody wants the calling thread's work any more (base/loading.h). */
ca_status ca_film_bars_add(const ca_film *film, uint32_t threads, ca_image_layers *layers, ca_error *error);

#endif
