// Khronos' glTF validator on a file: prints what it finds, and fails unless that is nothing. See glb.py.
import { readFileSync } from "node:fs";
import validator from "gltf-validator";

const report = await validator.validateBytes(new Uint8Array(readFileSync(process.argv[2])));
console.log(JSON.stringify({ validator: report.validatorVersion, issues: report.issues, info: report.info }, null, 1));
process.exit(report.issues.numErrors + report.issues.numWarnings > 0 ? 1 : 0);
