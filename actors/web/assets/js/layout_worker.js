// @ts-check
// Lays out a graph in a worker, because hundreds of vertices take seconds, in which the page must not block.

import { layOut } from "./layout.js";

self.onmessage = ({ data: { number, boxes, edges } }) => self.postMessage({ number, positions: [...layOut(boxes, edges)] });
