// Reads an MCAP file as a web page does, with nothing but what the file says of its schemas: `node read.mjs FILE`
// prints every message as JSON, by topic.
import {readFileSync} from 'node:fs';
import {McapIndexedReader} from '@mcap/core';
import {decompress} from 'fzstd';
import protobuf from 'protobufjs';
import descriptor from 'protobufjs/ext/descriptor/index.js';

const bytes = readFileSync(process.argv[2]);
const readable = {
  size: async () => BigInt(bytes.length),
  read: async (offset, size) => bytes.subarray(Number(offset), Number(offset + size)),
};
const reader = await McapIndexedReader.Initialize({
  readable,
  decompressHandlers: {zstd: data => decompress(data)},
});
const types = new Map();
for (const {id, name, encoding, data} of reader.schemasById.values()) {
  if (encoding !== 'protobuf') throw new Error(`${name}: ${encoding}`);
  types.set(
    id,
    protobuf.Root.fromDescriptor(descriptor.FileDescriptorSet.decode(data)).lookupType(name),
  );
}
const topics = {};
for await (const message of reader.readMessages()) {
  const {topic, schemaId} = reader.channelsById.get(message.channelId);
  const type = types.get(schemaId);
  const value = type.toObject(type.decode(message.data), {
    defaults: true,
    longs: Number,
    bytes: String,
  });
  (topics[topic] ??= []).push({
    log_ns: Number(message.logTime),
    publish_ns: Number(message.publishTime),
    value,
  });
}
console.log(JSON.stringify(topics));
