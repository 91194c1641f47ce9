// @ts-check
// Lays a graph out beside the page: hundreds of vertices take seconds.

import { laidOut } from "./layout.js";

self.onmessage = ({ data: { number, boxes, edges } }) => self.postMessage({ number, positions: [...laidOut(boxes, edges)] });
