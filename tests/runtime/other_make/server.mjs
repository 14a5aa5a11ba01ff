// An OPC UA server of another make (node-opcua) with the nodes of a machine: node server.mjs FOLDER CLIENT.der
// Prints one line of JSON when it is ready; a line on standard input changes it: {"freeze": true}, {"stop": true}.
import { createRequire } from "node:module";
import path from "node:path";
import readline from "node:readline";

const require = createRequire(path.join(process.env.NODE_OPCUA, "package.json"));
const opcua = require("node-opcua");
const [folder, client] = process.argv.slice(2);
const { OPCUAServer, OPCUACertificateManager, DataType, Variant, StatusCodes, UserTokenType } = opcua;

const own = new OPCUACertificateManager({ rootFolder: path.join(folder, "pki"), automaticallyAcceptUnknownCertificate: false });
await own.initialize();
const fs = await import("node:fs");
const trusted = opcua.readCertificate ? opcua.readCertificate(client) : fs.readFileSync(client);
await own.trustCertificate(Array.isArray(trusted) ? trusted[0] : trusted);

const server = new OPCUAServer({
    port: 0,
    host: "127.0.0.1",
    hostname: "127.0.0.1",
    serverCertificateManager: own,
    securityPolicies: [opcua.SecurityPolicy.Basic256Sha256],
    securityModes: [opcua.MessageSecurityMode.SignAndEncrypt],
    allowAnonymous: false,
    userManager: { isValidUser: (user, password) => user === "compensator" && password === "correct horse" },
    serverInfo: { applicationUri: "urn:other:machine" },
});
await server.initialize();
const space = server.engine.addressSpace;
const own_space = space.getOwnNamespace();
const machine = own_space.addObject({ organizedBy: space.rootFolder.objects, browseName: "Machine" });
let frozen = false;
const inputs = JSON.parse(process.env.INPUTS);
const nodes = {};
for (const [name, value] of Object.entries(inputs)) {
    nodes[name] = own_space.addVariable({
        componentOf: machine, browseName: name, nodeId: `s=${name}`, dataType: "Double",
        minimumSamplingInterval: 100,
    });
    nodes[name].setValueFromSource({ dataType: DataType.Double, value });
}
setInterval(() => {
    if (frozen) { return; }
    for (const [name, value] of Object.entries(inputs)) {
        nodes[name].setValueFromSource({ dataType: DataType.Double, value: value + 1e-3 * Math.sin(Date.now() / 1e3) });
    }
}, 100);
function writable(name, dataType, value) {
    const node = own_space.addVariable({
        componentOf: machine, browseName: name, nodeId: `s=${name}`, dataType,
        accessLevel: "CurrentRead | CurrentWrite", userAccessLevel: "CurrentRead | CurrentWrite",
    });
    node.setValueFromSource({ dataType: DataType[dataType], value });
    return node;
}
const written = JSON.parse(process.env.OFFSETS).map((name) => writable(`offset ${name}`, "Double", 0.0));
const status = writable("status", "UInt32", 0);
const heartbeat = writable("heartbeat", "UInt32", 0);
writable("message", "String", "");
writable("enable", "Boolean", true);
writable("acknowledge", "Boolean", false);
await server.start();
const url = server.getEndpointUrl();
console.log(JSON.stringify({ url, namespace: own_space.index }));
readline.createInterface({ input: process.stdin }).on("line", async (line) => {
    const wish = JSON.parse(line);
    if (wish.freeze !== undefined) { frozen = wish.freeze; }
    if (wish.show) {
        const shown = { status: status.readValue().value.value, heartbeat: heartbeat.readValue().value.value };
        shown.offsets = written.map((node) => node.readValue().value.value);
        console.log(JSON.stringify(shown));
    }
    if (wish.stop) { await server.shutdown(0); process.exit(0); }
});
