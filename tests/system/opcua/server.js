"use strict";
/*
 * A machine's OPC UA server as others write it: node-opcua, string node ids as a SINUMERIK has them.
 *
 * node server.js SETTINGS.json
 *
 * Standard input takes one JSON object per line (see `obey`); when it ends, the server ends. Standard
 * output says "READY {...}" on one line once it listens, "DONE {...}" after every command.
 *
 * Behind the nodes stands a small machine. Every `plc_s` it looks at the heartbeat; when that moved,
 * the offsets that were written become the accepted ones, and the effective ones follow them at a
 * rate of the machine's own. When the heartbeat rests for longer than `watchdog_s`, they fade. The
 * machine limits nothing that is asked of it within its range: what it records is what was asked.
 */
const fs = require("node:fs");
const path = require("node:path");
// Node 18 has it, but not among the globals, where node-opcua looks for it.
globalThis.crypto ??= require("node:crypto").webcrypto;

const settings = {
  port: 0,
  resource_path: "/sinumerik",
  application_uri: "urn:thermaxis:test:machine",
  pki: null, // folder of keys and certificates; must be given
  record: null, // file to which every accepted offset is appended; must be given
  secured: true, // Basic256Sha256, SignAndEncrypt
  unsecured: false,
  anonymous: false,
  strict: true, // unknown client certificates are rejected
  users: {}, // name -> {password, role: "operator" | "viewer"}
  sessions: 10,
  connections: 10,
  token_life_s: 600,
  life_s: 900, // hard end
  standby: false, // prepare everything, listen when told to
  names_before: 0, // foreign namespaces registered before the machine's own
  origin_s: null, // monotonic time at which the temperatures began to rise
  sampling_s: 0.1,
  resolution_k: 0.1,
  swing_k: 0.0, // amplitude of a sine on top of Temp1; half of it on Temp2
  swing_s: 60.0, // its period
  plc_s: 0.02,
  watchdog_s: 2.0, // null: it has none
  machine_rate_um_per_s: 20.0,
  range_um: 500.0, // a larger offset is answered with BadOutOfRange
  offset_at_start: "kept", // "kept" as the record says, or a number [um]
  clock_shift_s: 0.0, // how far the machine's clock is ahead
  temperatures: 3, // how many there are; a fourth offset W where there are more than three
  touch_s: null, // its own probe touches Z so often, a chip each fifth time; null: it has none
  record_writes: false, // every write of an offset, with where the offset stood before it
};
Object.assign(settings, JSON.parse(fs.readFileSync(process.argv[2], "utf8")));
shiftClock(settings.clock_shift_s);
const opcua = require("node-opcua");
const { DataType, StatusCodes, Variant, WellKnownRoles } = opcua;

const MACHINE_URI = "urn:thermaxis:test:machine:plc";
const FAULTS = [
  "none", "bad", "frozen", "uncertain", "nan", "null", "exit", "busy", "deaf", "refuse", "jump", "stuck",
];
const TEMPERATURES = {
  Temp1: { start_c: 21.0, rise_k: 12.0, time_constant_s: 300.0, swings: 1.0 },
  Temp2: { start_c: 20.5, rise_k: 6.0, time_constant_s: 900.0, swings: 0.5 },
  Temp3: { start_c: 20.0, rise_k: 1.5, time_constant_s: 3600.0, swings: 0.0 },
};
for (let k = 4; k <= settings.temperatures; k += 1) {
  TEMPERATURES[`Temp${k}`] = { ...TEMPERATURES.Temp2, start_c: 20.0 + 0.1 * k };
}
const OFFSETS = {
  Z: { dataType: "Double", um: 1000.0 }, // [mm]
  X: { dataType: "Float", um: 1.0 }, // [um]
  Y: { dataType: "Int32", um: 0.1 }, // [0.1 um], as TNC controls count
  ...(settings.temperatures > 3 && { W: { dataType: "Double", um: 1000.0 } }),
};
const NOWHERE = Object.fromEntries(Object.keys(OFFSETS).map((name) => [name, 0.0]));
const BIGGEST_UM = { Double: Infinity, Float: Infinity, Int32: 2147483647 * 0.1 };

const flags = {
  Referenced: true, MachineOn: true, Homing: false, EmergencyStop: false, OwnCompensation: false,
};
const machine = {
  fault: "none",
  channel: "Temp1",
  busy_s: 3.0,
  heartbeat: 0,
  seen: 0, // heartbeat of the last PLC cycle
  moved_s: null, // when it last moved
  writes: 0,
  late_s: 0.0, // the PLC takes offsets over so often
  taken_s: 0.0,
  diameter_mm: 0.0,
  touch_um: 0.0,
  touches: 0,
  written_um: { ...NOWHERE },
  accepted_um: { ...NOWHERE },
  effective_um: { ...NOWHERE },
};

function shiftClock(seconds) {
  if (!seconds) return;
  const TrueDate = Date;
  globalThis.Date = class extends TrueDate {
    constructor(...given) {
      if (given.length) super(...given);
      else super(TrueDate.now() + 1000 * seconds);
    }
    static now() {
      return TrueDate.now() + 1000 * seconds;
    }
  };
}

function now_s() {
  return Number(process.hrtime.bigint()) / 1e9; // the computer's monotonic clock, as Python's
}

function say(word, content) {
  fs.writeSync(1, `${word} ${JSON.stringify(content)}\n`);
}

// ---- the record: what the machine was told, written at once, so that no kill loses a line --------

function record(kind, content) {
  const line = { kind, monotonic_s: now_s(), utc_s: Date.now() / 1000, ...content };
  fs.appendFileSync(settings.record, `${JSON.stringify(line)}\n`);
}

function offsetsAtStart() {
  if (typeof settings.offset_at_start === "number") {
    return Object.fromEntries(Object.keys(OFFSETS).map((name) => [name, settings.offset_at_start]));
  }
  if (!fs.existsSync(settings.record)) return { ...machine.accepted_um };
  const lines = fs.readFileSync(settings.record, "utf8").split("\n").filter((line) => line);
  const told = lines.map((line) => JSON.parse(line)).filter((line) => line.accepted_um);
  return told.length ? told[told.length - 1].accepted_um : { ...machine.accepted_um };
}

// ---- the machine --------------------------------------------------------------------------------

function plcCycle() {
  const moved = machine.heartbeat !== machine.seen && machine.fault !== "deaf";
  machine.seen = machine.heartbeat;
  if (moved) {
    if (machine.moved_s === null) record("watchdog", { met: true });
    machine.moved_s = now_s();
  }
  const takes = moved && now_s() - machine.taken_s >= machine.late_s;
  if (takes) {
    machine.taken_s = now_s();
    machine.accepted_um = { ...machine.written_um };
  }
  const limit_s = settings.watchdog_s ?? Infinity;
  if (machine.moved_s !== null && now_s() - machine.moved_s > limit_s) {
    machine.moved_s = null;
    record("watchdog", { met: false, effective_um: shown(machine.effective_um) });
  }
  if (machine.fault !== "stuck") follow();
  if (takes) {
    const { heartbeat, writes } = machine;
    const [accepted_um, effective_um] = [shown(machine.accepted_um), shown(machine.effective_um)];
    record("accepted", { accepted_um, effective_um, heartbeat, writes });
  }
}

function follow() {
  const step = settings.machine_rate_um_per_s * settings.plc_s;
  for (const name of Object.keys(OFFSETS)) {
    const goal = machine.moved_s === null ? 0.0 : machine.accepted_um[name];
    const way = goal - machine.effective_um[name];
    if (Number.isFinite(way)) machine.effective_um[name] += Math.max(-step, Math.min(step, way));
  }
}

/* What the model lacks, and what of the offset does not act yet. */
function touch() {
  const chip_um = machine.touches % 5 === 4 ? 50.0 : 0.0;
  const lacking_um = 3.0 * Math.sin(now_s() / 20.0);
  machine.touch_um = lacking_um + machine.effective_um.Z - machine.accepted_um.Z + chip_um;
  machine.touches += 1;
}

function shown(values) {
  const text = (value) => (Number.isFinite(value) ? value : String(value)); // JSON has no NaN
  return Object.fromEntries(Object.entries(values).map(([name, value]) => [name, text(value)]));
}

function temperature(name) {
  const { start_c, rise_k, time_constant_s, swings } = TEMPERATURES[name];
  const since_s = now_s() - settings.origin_s;
  const swing_k = settings.swing_k * swings * Math.sin((2 * Math.PI * since_s) / settings.swing_s);
  const value = start_c + rise_k * (1.0 - Math.exp(-since_s / time_constant_s)) + swing_k;
  return Math.round(value / settings.resolution_k) * settings.resolution_k;
}

function sample(variable, name) {
  const fault = machine.channel === name ? machine.fault : "none";
  const value = temperature(name);
  const double = (number) => ({ dataType: DataType.Double, value: number });
  if (fault === "frozen") return;
  if (fault === "bad") variable.setValueFromSource(double(0.0), StatusCodes.BadSensorFailure);
  else if (fault === "uncertain") {
    variable.setValueFromSource(double(value), StatusCodes.UncertainSensorNotAccurate);
  } else if (fault === "nan") variable.setValueFromSource(double(NaN), StatusCodes.Good);
  else if (fault === "null") {
    variable.setValueFromSource({ dataType: DataType.Null }, StatusCodes.BadNoCommunication);
  } else variable.setValueFromSource(double(fault === "jump" ? value + 15.0 : value));
}

let sampleAll = () => undefined;

function takeFault(fault, channel) {
  if (!FAULTS.includes(fault)) throw new Error(`no such fault: ${fault}`);
  machine.fault = fault;
  machine.channel = channel ?? machine.channel;
  if (fault === "exit") setImmediate(() => process.exit(1));
  if (fault === "busy") {
    machine.fault = "none";
    setTimeout(() => {
      const end_s = now_s() + machine.busy_s;
      while (now_s() < end_s);
    }, 20);
  }
}

// ---- nodes --------------------------------------------------------------------------------------

const READ = "Browse | Read | ReadRolePermissions";
const forOperators = [
  {
    roleId: WellKnownRoles.AuthenticatedUser,
    permissions: opcua.makePermissionFlag(READ),
  },
  {
    roleId: WellKnownRoles.Anonymous,
    permissions: opcua.makePermissionFlag(settings.anonymous ? `${READ} | Write` : "Browse"),
  },
  { roleId: WellKnownRoles.Operator, permissions: opcua.makePermissionFlag(`${READ} | Write`) },
];

function addNodes(server) {
  const addressSpace = server.engine.addressSpace;
  for (let i = 0; i < settings.names_before; i += 1) {
    addressSpace.registerNamespace(`urn:thermaxis:test:foreign:${i}`);
  }
  const space = addressSpace.registerNamespace(MACHINE_URI);
  const folder = space.addObject({
    organizedBy: addressSpace.rootFolder.objects, browseName: "Plc", nodeId: "s=/Plc",
  });
  const add = (name, dataType, value, extra = {}) =>
    space.addVariable({
      componentOf: folder, browseName: name, nodeId: `s=/Plc/${name}`, dataType,
      minimumSamplingInterval: 5, accessLevel: "CurrentRead", userAccessLevel: "CurrentRead",
      value, ...extra,
    });
  const readable = (name, dataType, get) =>
    add(name, dataType, { get: () => new Variant({ dataType: DataType[dataType], value: get() }) });
  const writable = (name, dataType, get, set) =>
    add(
      name, dataType,
      { get: () => new Variant({ dataType: DataType[dataType], value: get() }), set },
      {
        accessLevel: "CurrentRead | CurrentWrite", userAccessLevel: "CurrentRead | CurrentWrite",
        rolePermissions: forOperators,
      },
    );
  addTemperatures(add);
  addOffsets(readable, writable);
  addRest(readable, writable);
  return folder.nodeId.namespace;
}

function addTemperatures(add) {
  const variables = Object.keys(TEMPERATURES).map((name) => [name, add(name, "Double")]);
  sampleAll = () => variables.forEach(([name, variable]) => sample(variable, name));
  sampleAll();
  setInterval(() => sampleAll(), 1000 * settings.sampling_s);
}

function addOffsets(readable, writable) {
  for (const [name, { dataType, um }] of Object.entries(OFFSETS)) {
    const own = (value_um) => (dataType === "Int32" ? Math.round(value_um / um) : value_um / um);
    const set = (variant) => {
      if (machine.fault === "refuse") return StatusCodes.BadNotWritable;
      const value_um = variant.value * um;
      const limit_um = Math.min(settings.range_um, BIGGEST_UM[dataType]);
      if (Math.abs(value_um) > limit_um) return StatusCodes.BadOutOfRange;
      if (settings.record_writes) {
        const [node_um, accepted_um] = [machine.written_um[name], machine.accepted_um[name]];
        const stood = { node_um, took_um: accepted_um, acts_um: machine.effective_um[name] };
        const met = machine.moved_s !== null;
        record("write", { axis: name, ...stood, met, told_um: value_um });
      }
      machine.written_um[name] = value_um; // NaN passes, as with real servers
      machine.writes += 1;
      return StatusCodes.Good;
    };
    writable(`Offset${name}`, dataType, () => own(machine.written_um[name]), set);
    readable(`Accepted${name}`, dataType, () => own(machine.accepted_um[name]));
    readable(`Effective${name}`, dataType, () => own(machine.effective_um[name]));
  }
}

function addRest(readable, writable) {
  const beat = (variant) => {
    machine.heartbeat = variant.value;
    return StatusCodes.Good;
  };
  writable("Heartbeat", "UInt32", () => machine.heartbeat, beat);
  readable("WriteCount", "UInt32", () => machine.writes);
  readable("WatchdogMet", "Boolean", () => machine.moved_s !== null);
  readable("Diameter", "Double", () => machine.diameter_mm);
  readable("TouchZ", "Double", () => machine.touch_um);
  readable("Touches", "UInt32", () => machine.touches);
  if (settings.touch_s) setInterval(touch, 1000 * settings.touch_s);
  for (const name of Object.keys(flags)) readable(name, "Boolean", () => flags[name]);
  readable("M5.0", "Byte", () => (flags.Referenced ? 1 : 0)); // a flag as a number
  readable("State", "String", () => (flags.MachineOn ? "on" : "off"));
  const set = (variant) => {
    const name = FAULTS[variant.value];
    if (name === undefined) return StatusCodes.BadOutOfRange;
    takeFault(name, null);
    return StatusCodes.Good;
  };
  writable("Fault", "Int32", () => FAULTS.indexOf(machine.fault), set);
}

// ---- users, certificates, endpoints -------------------------------------------------------------

const userManager = {
  isValidUser: (name, password) => settings.users[name]?.password === password,
  getUserRoles: (name) => {
    if (name === "anonymous") return opcua.makeRoles([WellKnownRoles.Anonymous]);
    const roles = [WellKnownRoles.AuthenticatedUser];
    if (settings.users[name]?.role === "operator") roles.push(WellKnownRoles.Operator);
    return opcua.makeRoles(roles);
  },
};

async function makeServer() {
  const certificates = new opcua.OPCUACertificateManager({
    rootFolder: settings.pki, automaticallyAcceptUnknownCertificate: !settings.strict,
  });
  await certificates.initialize();
  const modes = [];
  const policies = [];
  if (settings.secured) {
    modes.push(opcua.MessageSecurityMode.SignAndEncrypt);
    policies.push(opcua.SecurityPolicy.Basic256Sha256);
  }
  if (settings.unsecured) {
    modes.push(opcua.MessageSecurityMode.None);
    policies.push(opcua.SecurityPolicy.None);
  }
  return new opcua.OPCUAServer({
    host: "127.0.0.1",
    hostname: "127.0.0.1",
    port: settings.port,
    resourcePath: settings.resource_path,
    serverInfo: { applicationUri: settings.application_uri },
    securityModes: modes,
    securityPolicies: policies,
    allowAnonymous: settings.anonymous,
    userManager,
    serverCertificateManager: certificates,
    userCertificateManager: certificates,
    defaultSecureTokenLifetime: 1000 * settings.token_life_s,
    maxConnectionsPerEndpoint: settings.connections,
    serverCapabilities: { maxSessions: settings.sessions },
  });
}

// ---- commands -----------------------------------------------------------------------------------

let listen = async () => undefined;

async function obey(line) {
  const command = JSON.parse(line);
  if ("fault" in command) takeFault(command.fault, command.channel);
  if ("busy_s" in command) machine.busy_s = command.busy_s;
  if ("late_s" in command) machine.late_s = command.late_s;
  if ("others_um" in command) { // another writer, whose value is taken over at once
    Object.assign(machine.written_um, command.others_um);
    Object.assign(machine.accepted_um, command.others_um);
    record("other", { others_um: command.others_um });
  }
  if ("diameter_mm" in command) machine.diameter_mm = command.diameter_mm;
  for (const [name, value] of Object.entries(command.flags ?? {})) {
    if (!(name in flags)) throw new Error(`no such flag: ${name}`);
    flags[name] = value;
  }
  if (command.sample) sampleAll();
  if (command.plc_cycle) plcCycle();
  if (command.listen) await listen();
  else say("DONE", command);
}

function takeCommands() {
  let rest = "";
  process.stdin.setEncoding("utf8");
  process.stdin.on("data", (text) => {
    const lines = (rest + text).split("\n");
    rest = lines.pop();
    for (const line of lines) {
      obey(line).catch((error) => {
        say("FAILED", { reason: String(error), line });
        process.exit(2);
      });
    }
  });
  process.stdin.on("end", () => process.exit(0)); // whoever started it has ended
}

async function main() {
  setTimeout(() => process.exit(3), 1000 * settings.life_s);
  settings.origin_s ??= now_s();
  machine.accepted_um = offsetsAtStart();
  machine.written_um = { ...machine.accepted_um };
  machine.effective_um = { ...machine.accepted_um };
  const server = await makeServer();
  await server.initialize();
  const namespace = addNodes(server);
  listen = async () => {
    await server.start();
    const [accepted_um, effective_um] = [shown(machine.accepted_um), shown(machine.effective_um)];
    record("start", { pid: process.pid, accepted_um, effective_um });
    // a PLC outlives its server: an offset that was kept acts until the watchdog has run out
    if (Object.values(machine.accepted_um).some((value) => value !== 0)) machine.moved_s = now_s();
    setInterval(plcCycle, 1000 * settings.plc_s);
    say("READY", {
      endpoint: server.getEndpointUrl(),
      port: server.endpoints[0].port,
      certificate: server.certificateFile,
      namespace,
      namespace_uri: MACHINE_URI,
      monotonic_s: now_s(),
      pid: process.pid,
    });
  };
  takeCommands();
  if (settings.standby) say("STANDBY", { pid: process.pid, prepared: path.resolve(settings.pki) });
  else await listen();
}

main().catch((error) => {
  say("FAILED", { reason: String(error.stack ?? error) });
  process.exit(2);
});
