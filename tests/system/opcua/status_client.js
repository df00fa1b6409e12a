"use strict";
// A client written by others (node-opcua) against the status server: prints one line of JSON.
// Arguments: address, user (empty: nobody, without security). The password comes by the environment.

const opcua = require("node-opcua");

async function main() {
  const [address, userName] = process.argv.slice(2);
  const encrypted = Boolean(userName);
  const client = opcua.OPCUAClient.create({
    endpointMustExist: false,
    connectionStrategy: { maxRetry: 1 },
    securityMode: encrypted ? opcua.MessageSecurityMode.SignAndEncrypt : opcua.MessageSecurityMode.None,
    securityPolicy: encrypted ? opcua.SecurityPolicy.Basic256Sha256 : opcua.SecurityPolicy.None,
  });
  const told = { notified: [], times: 0, calls: {} };
  await client.connect(address);
  const user = { type: opcua.UserTokenType.UserName, userName, password: process.env.STATUS_PASSWORD };
  const session = await client.createSession(encrypted ? user : undefined);
  const index = (await session.readNamespaceArray()).indexOf("urn:thermaxis:runtime");
  const id = (path) => `ns=${index};s=${path}`;
  const folder = await session.browse(id("Thermaxis"));
  told.folders = folder.references.map((reference) => reference.browseName.name);
  const state = await session.read({ nodeId: id("Status/State") });
  told.state = [state.value.value, state.statusCode.name];
  told.parts = (await session.read({ nodeId: id("Outputs/Z_um/PartNames") })).value.value;
  told.running = (await session.read({ nodeId: "i=2256" })).value.value.state;
  told.arguments = (await session.getArgumentDefinition(id("Requests/Trim"))).inputArguments.map(
    (argument) => argument.name,
  );
  const subscription = await session.createSubscription2({
    requestedPublishingInterval: 100,
    requestedLifetimeCount: 100,
    requestedMaxKeepAliveCount: 10,
    maxNotificationsPerPublish: 100,
    publishingEnabled: true,
  });
  const watch = async (nodeId, callback) => {
    const item = await subscription.monitor(
      { nodeId, attributeId: opcua.AttributeIds.Value },
      { samplingInterval: 100, discardOldest: true, queueSize: 10 },
      opcua.TimestampsToReturn.Both,
    );
    item.on("changed", callback);
  };
  const enough = new Promise((resolve) => {
    const look = () => {
      if (told.notified.length >= 3 && told.times >= 2) resolve();
    };
    watch(id("Outputs/Z_um/Correction"), (value) => {
      told.notified.push(value.value.value);
      look();
    });
    watch("i=2258", () => {
      told.times += 1;
      look();
    });
  });
  await enough;
  const trim = [
    { dataType: opcua.DataType.String, value: "Z_um" },
    { dataType: opcua.DataType.Double, value: 1.5 },
    { dataType: opcua.DataType.Double, value: 60 },
  ];
  for (const [method, inputArguments] of [["WhoAmI", []], ["Enable", []], ["Trim", trim]]) {
    const result = await session.call({
      objectId: id("Requests"),
      methodId: id(`Requests/${method}`),
      inputArguments,
    });
    const values = (result.outputArguments || []).map((value) => value.value);
    told.calls[method] = [result.statusCode.name, ...values];
  }
  await subscription.terminate();
  await session.close();
  await client.disconnect();
  process.stdout.write(`\n${JSON.stringify(told)}\n`);
}

main().catch((error) => {
  process.stderr.write(`${error.message}\n`);
  process.exit(1);
});
